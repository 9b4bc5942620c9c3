/// Meshes. Inline ones are by far the longest part of long documents, so the common case uses no cursor per number.

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"
#include "tracer/triangulate.h"

namespace api {
namespace {

using Corners = std::array<std::uint32_t, 3>;
constexpr std::uint32_t index_max = std::numeric_limits<std::uint32_t>::max() - 1;

/// Reads three indices without a cursor for each; false if they need issues.
bool read_plain(const json::Node* node, Corners& corners) {
  if (node->kind != json::Kind::array || node->size != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const json::Node& element = node[1 + i];
    const double number = element.number;
    if (element.kind != json::Kind::number || !(number >= 0 && number <= index_max)) return false;
    corners[i] = static_cast<std::uint32_t>(number);
    if (static_cast<double>(corners[i]) != number) return false;
  }
  return true;
}

bool read_index(Reading& reading, const Cursor& at, std::uint32_t& index) {
  return read(reading, at, Integer<std::uint32_t>{index, 0, index_max});
}

/// Appends an element to `values` for each element of the array.
template <class T, class ReadElement>
bool read_list(Reading& reading, const Cursor& at, std::vector<T>& values, const ReadElement& read_element) {
  if (at.node->kind == json::Kind::array) values.reserve(at.node->size);
  return for_each_element(reading, at, [&](const Cursor& element) { read_element(element, values.emplace_back()); });
}

template <class Vector>
bool read_vectors(Reading& reading, const std::optional<Cursor>& at, std::vector<Vector>& vectors) {
  return at && read_list(reading, *at, vectors,
                         [&](const Cursor& element, Vector& vector) { read(reading, element, vector); });
}

void read_triangles(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  read_list(reading, at, mesh.triangles, [&](const Cursor& element, Corners& corners) {
    if (read_plain(element.node, corners)) return;
    corners = {};
    if (!expect_length(reading, element, 3)) return;
    for_each_element(reading, element,
                     [&](const Cursor& corner) { read_index(reading, corner, corners[corner.index]); });
  });
}

/// The indices of a polygon's corners. Returns false, with an issue, if one is invalid.
bool read_polygon(Reading& reading, const Cursor& at, std::size_t position_count, std::vector<std::uint32_t>& polygon) {
  polygon.clear();
  bool valid = true;
  if (at.node->kind == json::Kind::array && at.node->size < 3)
    return add_issue(reading, at, "wrong_length",
                     "a face must have at least 3 corners, has " + std::to_string(at.node->size));
  const bool is_array = for_each_element(reading, at, [&](const Cursor& corner) {
    std::uint32_t& index = polygon.emplace_back();
    valid &= read_index(reading, corner, index) &&
             (index < position_count || add_issue(reading, corner, "out_of_range",
                                                  "must be the index of one of the " + std::to_string(position_count) +
                                                      " positions, got " + std::to_string(index)));
  });
  return is_array && valid;
}

void read_faces(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  std::vector<std::uint32_t> polygon;
  std::vector<tracer::Vec3> corners;
  std::vector<Corners> triangles;
  for_each_element(reading, at, [&](const Cursor& element) {
    if (!read_polygon(reading, element, mesh.positions.size(), polygon)) return;
    corners.clear();
    for (const std::uint32_t index : polygon) corners.push_back(mesh.positions[index]);
    triangles.clear();
    if (!tracer::triangulate(corners, triangles)) {
      add_issue(reading, element, "limit_exceeded",
                "the limit ear_clipping_corners_max is " + std::to_string(tracer::ear_clipping_corners_max) +
                    " for faces that are no fan around their first corner (convex ones are), this one has " +
                    std::to_string(polygon.size()));
      return;
    }
    for (const auto& [a, b, c] : triangles) mesh.triangles.push_back({polygon[a], polygon[b], polygon[c]});
  });
}

void read_connectivity(Reading& reading, Fields& fields, tracer::Mesh& mesh) {
  const auto faces = fields.take("faces");
  const auto triangles = faces ? fields.take("triangles") : fields.take_required("triangles");
  if (triangles) read_triangles(reading, *triangles, mesh);
  if (triangles && faces) {
    add_issue(reading, *faces, "conflict", "a mesh has \"triangles\" or \"faces\", not both");
  } else if (faces) {
    read_faces(reading, *faces, mesh);
  }
}

/// The fields that the file contains must not be written in the document too.
void read_file(Reading& reading, Fields& fields, tracer::Mesh& mesh) {
  if (tracer::AssetId asset; fields.optional("file", asset)) mesh.file = asset;
  for (const std::string_view name : {"positions", "triangles", "faces", "normals", "uvs"})
    if (const auto field = fields.take(name))
      add_issue(reading, *field, "conflict", "must not be written: the mesh's file contains it");
}

}  // namespace

void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape) {
  auto& mesh = shape.emplace<tracer::Mesh>();
  fields.optional("smooth", mesh.smooth);
  if (fields.has("file")) return read_file(reading, fields, mesh);
  const bool has_positions = read_vectors(reading, fields.take_required("positions"), mesh.positions);
  read_connectivity(reading, fields, mesh);
  read_vectors(reading, fields.take("normals"), mesh.normals);
  read_vectors(reading, fields.take("uvs"), mesh.uvs);
  if (!has_positions) shape = tracer::Sphere{};  // without positions, validate would report every index
}

}  // namespace api
