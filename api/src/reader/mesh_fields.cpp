/// Meshes. Inline ones are by far the longest part of long documents, so the plain case takes no cursor per number.

#include <array>
#include <cmath>
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
constexpr double index_max = std::numeric_limits<std::uint32_t>::max() - 1;

/// Three integers of the right size, without a cursor.
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

bool read_vectors(Reading& reading, const Cursor& at, std::vector<tracer::Vec3>& vectors) {
  if (at.node->kind == json::Kind::array) vectors.reserve(at.node->size);
  return for_each_element(reading, at, [&](const Cursor& element) { read(reading, element, vectors.emplace_back()); });
}

void read_uvs(Reading& reading, const Cursor& at, std::vector<tracer::Vec2>& uvs) {
  if (at.node->kind == json::Kind::array) uvs.reserve(at.node->size);
  for_each_element(reading, at, [&](const Cursor& element) { read(reading, element, uvs.emplace_back()); });
}

bool read_index(Reading& reading, const Cursor& at, std::uint32_t& index) {
  return read(reading, at, Integer<std::uint32_t>{index, 0, static_cast<std::uint32_t>(index_max)});
}

void read_triangles(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  if (at.node->kind == json::Kind::array) mesh.triangles.reserve(at.node->size);
  for_each_element(reading, at, [&](const Cursor& element) {
    Corners& corners = mesh.triangles.emplace_back();
    if (read_plain(element.node, corners)) return;
    corners = {};
    if (!expect_length(reading, element, 3)) return;
    for_each_element(reading, element,
                     [&](const Cursor& corner) { read_index(reading, corner, corners[corner.index]); });
  });
}

/// A polygon's indices; false when one of them is wrong, which has been told.
bool read_polygon(Reading& reading, const Cursor& at, std::size_t position_count, std::vector<std::uint32_t>& polygon) {
  polygon.clear();
  bool valid = for_each_element(reading, at, [](const Cursor&) {});
  if (valid && at.node->size < 3) {
    add_issue(reading, at, "wrong_length", "a face must have at least 3 corners, has " + std::to_string(at.node->size));
    return false;
  }
  if (!valid) return false;
  for_each_element(reading, at, [&](const Cursor& corner) {
    std::uint32_t index = 0;
    if (!read_index(reading, corner, index)) {
      valid = false;
    } else if (index >= position_count) {
      valid = false;
      add_issue(reading, corner, "out_of_range",
                "must be the index of one of the " + std::to_string(position_count) + " positions, got " +
                    std::to_string(index));
    }
    polygon.push_back(index);
  });
  return valid;
}

void read_faces(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  std::vector<std::uint32_t> polygon;
  std::vector<tracer::Vec3> corners;
  std::vector<Corners> cut;
  for_each_element(reading, at, [&](const Cursor& element) {
    if (!read_polygon(reading, element, mesh.positions.size(), polygon)) return;
    corners.clear();
    for (const std::uint32_t index : polygon) corners.push_back(mesh.positions[index]);
    cut.clear();
    if (!tracer::triangulate(corners, cut)) {
      add_issue(reading, element, "limit_exceeded",
                "the limit ear_clipping_corners_max is " + std::to_string(tracer::ear_clipping_corners_max) +
                    " for faces that are no fan around their first corner (convex ones are), this one has " +
                    std::to_string(polygon.size()));
      return;
    }
    for (const Corners& triangle : cut) {
      mesh.triangles.push_back({polygon[triangle[0]], polygon[triangle[1]], polygon[triangle[2]]});
    }
  });
}

void read_connectivity(Reading& reading, Fields& fields, tracer::Mesh& mesh) {
  const auto triangles = fields.take("triangles");
  const auto faces = fields.take("faces");
  if (triangles) read_triangles(reading, *triangles, mesh);
  if (triangles && faces) {
    add_issue(reading, *faces, "conflict", "a mesh has \"triangles\" or \"faces\", not both");
  } else if (faces) {
    read_faces(reading, *faces, mesh);
  } else if (!triangles) {
    fields.report_missing_field("triangles");
  }
}

/// What a file brings cannot be written beside it.
void read_file(Reading& reading, Fields& fields, const Cursor& file, tracer::Mesh& mesh) {
  tracer::AssetId asset;
  if (read_asset(reading, file, asset)) mesh.file = asset;
  for (const std::string_view name : {"positions", "triangles", "faces", "normals", "uvs"}) {
    if (const auto written = fields.take(name))
      add_issue(reading, *written, "conflict", "is what the mesh's file brings");
  }
}

void read_written(Reading& reading, Fields& fields, tracer::Shape& shape) {
  auto& mesh = std::get<tracer::Mesh>(shape);
  const auto positions = fields.take("positions");
  const bool has_positions = positions && read_vectors(reading, *positions, mesh.positions);
  if (!positions) fields.report_missing_field("positions");
  read_connectivity(reading, fields, mesh);
  if (const auto normals = fields.take("normals")) read_vectors(reading, *normals, mesh.normals);
  if (const auto uvs = fields.take("uvs")) read_uvs(reading, *uvs, mesh.uvs);
  if (!has_positions) shape = tracer::Sphere{};  // without positions every index would be told as wrong
}

}  // namespace

void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape) {
  auto& mesh = shape.emplace<tracer::Mesh>();
  fields.optional("smooth", mesh.smooth);
  if (const auto file = fields.take("file")) {
    read_file(reading, fields, *file, mesh);
  } else {
    read_written(reading, fields, shape);
  }
}

}  // namespace api
