/// Objects and prototypes with their transforms and meshes. Inline meshes are by far the longest part of long
/// documents, so the common case uses no cursor per number.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"
#include "tracer/triangulate.h"

namespace api {
namespace {

using tracer::Transform;
using tracer::Vec3;

/// Cosine and sine of an angle in degrees, exact at multiples of 90: a quarter turn moves no coordinate by rounding.
std::array<double, 2> cosine_and_sine(double degrees) {
  const double turn = std::remainder(degrees, 360.0);
  if (turn == 0) return {1, 0};
  if (turn == 90) return {0, 1};
  if (turn == -90) return {0, -1};
  if (std::abs(turn) == 180) return {-1, 0};
  const double radians = turn * (std::numbers::pi / 180);
  return {std::cos(radians), std::sin(radians)};
}

/// About an axis through the origin, counter-clockwise seen against it (Rodrigues 1840).
Transform rotation(Vec3 axis, double degrees) {
  const double largest = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  axis = {axis.x / largest, axis.y / largest, axis.z / largest};  // first, or the length may overflow
  const double length = std::hypot(axis.x, axis.y, axis.z);
  axis = {axis.x / length, axis.y / length, axis.z / length};
  const auto [c, s] = cosine_and_sine(degrees);
  const double k = 1 - c;
  return {{{{c + k * axis.x * axis.x, k * axis.x * axis.y - s * axis.z, k * axis.x * axis.z + s * axis.y, 0},
            {k * axis.y * axis.x + s * axis.z, c + k * axis.y * axis.y, k * axis.y * axis.z - s * axis.x, 0},
            {k * axis.z * axis.x - s * axis.y, k * axis.z * axis.y + s * axis.x, c + k * axis.z * axis.z, 0}}}};
}

bool read_rotation(Reading& reading, const Cursor& at, Transform& step) {
  Vec3 axis;
  double angle = 0;
  Fields fields(reading, at, "a rotation");
  const auto axis_field = fields.take_required("axis");
  const bool has_axis = axis_field && read(reading, *axis_field, axis);
  const bool has_angle = fields.required("angle", angle);
  fields.finish();
  if (!has_axis || !has_angle) return false;
  if (axis.x == 0 && axis.y == 0 && axis.z == 0)
    return add_issue(reading, *axis_field, "degenerate", "must not be the zero vector");
  step = rotation(axis, angle);
  return true;
}

bool read_scale(Reading& reading, const Cursor& at, Transform& step) {
  Vec3 scale;
  if (at.node->kind == json::Kind::number) {
    if (!read(reading, at, scale.x)) return false;
    scale.y = scale.z = scale.x;
  } else if (!read(reading, at, scale)) {
    return false;
  }
  step.rows = {{{scale.x, 0, 0, 0}, {0, scale.y, 0, 0}, {0, 0, scale.z, 0}}};
  return true;
}

bool read_translation(Reading& reading, const Cursor& at, Transform& step) {
  Vec3 by;
  if (!read(reading, at, by)) return false;
  step.rows = {{{1, 0, 0, by.x}, {0, 1, 0, by.y}, {0, 0, 1, by.z}}};
  return true;
}

/// An object with exactly one of the members translate, rotate and scale.
bool read_step(Reading& reading, const Cursor& at, Transform& step) {
  Fields fields(reading, at, "a step of a transform");
  if (!fields)
    return add_wrong_type(reading, at, R"({"translate": [x, y, z]}, {"rotate": {...}} or {"scale": NUMBER})");
  int count = 0;
  bool valid = false;
  for (const auto& [name, read_kind] :
       {std::pair{"translate", &read_translation}, {"rotate", &read_rotation}, {"scale", &read_scale}}) {
    const auto field = fields.take(name);
    if (!field) continue;
    valid = read_kind(reading, *field, step);
    ++count;
  }
  fields.finish();
  if (count == 1) return valid;
  return add_issue(reading, at, count == 0 ? "missing_field" : "conflict",
                   R"(must have exactly one of "translate", "rotate", "scale")");
}

bool read_matrix(Reading& reading, const Cursor& at, Transform& matrix) {
  std::array<std::array<double, 4>, 4> rows{};
  if (!read(reading, at, rows)) return false;
  if (rows[3] != std::array<double, 4>{0, 0, 0, 1})
    return add_issue(reading, at, "out_of_range", "the last row must be [0, 0, 0, 1]: transforms are affine");
  matrix.rows = {rows[0], rows[1], rows[2]};
  return true;
}

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

/// False, with one issue for all of them, if the numbers of a list of vectors are not in groups of the given form.
bool is_grouped(Reading& reading, const Cursor& at, std::string_view form) {
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, "a list: [" + std::string(form) + ", ...]");
  const std::uint32_t size = at.node->size;
  const auto is_number = [](const json::Node& element) { return element.kind == json::Kind::number; };
  return size < 2 || !std::all_of(at.node + 1, at.node + 1 + size, is_number) ||
         add_issue(reading, at, "wrong_type",
                   "must be a list of lists, [" + std::string(form) + ", ...], got " + std::to_string(size) +
                       " numbers without inner brackets");
}

/// Appends an element to `values` for each element of the array.
template <class T, class ReadElement>
bool read_list(Reading& reading, const Cursor& at, std::string_view form, std::vector<T>& values,
               const ReadElement& read_element) {
  if (!is_grouped(reading, at, form)) return false;
  values.reserve(at.node->size);
  return for_each_element(reading, at, [&](const Cursor& element) { read_element(element, values.emplace_back()); });
}

template <class Vector>
bool read_vectors(Reading& reading, const std::optional<Cursor>& at, std::vector<Vector>& vectors) {
  return at && read_list(reading, *at, form_of<Vector>, vectors,
                         [&](const Cursor& element, Vector& vector) { read(reading, element, vector); });
}

void read_triangles(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  read_list(reading, at, "[0, 1, 2]", mesh.triangles, [&](const Cursor& element, Corners& corners) {
    if (read_plain(element.node, corners)) return;
    corners = {};
    if (!expect_length(reading, element, 3, "three indices: [0, 1, 2]")) return;
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
  if (!is_grouped(reading, at, "[0, 1, 2, 3]")) return;
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
  const auto triangles = faces ? fields.take("triangles") : fields.take_required("triangles", "[[0, 1, 2], ...]");
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

void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape) {
  auto& mesh = shape.emplace<tracer::Mesh>();
  fields.optional("smooth", mesh.smooth);
  if (fields.has("file")) return read_file(reading, fields, mesh);
  const bool has_positions =
      read_vectors(reading, fields.take_required("positions", "[[x, y, z], ...]"), mesh.positions);
  read_connectivity(reading, fields, mesh);
  read_vectors(reading, fields.take("normals"), mesh.normals);
  read_vectors(reading, fields.take("uvs"), mesh.uvs);
  if (!has_positions) shape = tracer::Sphere{};  // without positions, validate would report every index
}

constexpr auto& object_types = type_words<tracer::Shape>;

template <tracer::HasFields Shape>
void read_shape(Fields& fields, Shape& shape) {
  read_all_fields(fields, shape);
}

void read_shape(Fields& fields, tracer::Sphere& sphere) {
  read_all_fields(fields, sphere);
  // The meridian's default +x would be the pole; +z is perpendicular to the axis.
  if (!fields.has("meridian") && sphere.axis.y == 0 && sphere.axis.z == 0) sphere.meridian = {0, 0, 1};
}

/// The prototype may be defined before or after the instance.
void read_shape(Fields& fields, tracer::Instance& instance) {
  fields.required("of", instance.of);
  fields.optional("material", instance.material);
}

void read_object(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  // An invalid object is kept, so that indices remain those of the document.
  tracer::Object& object = objects.emplace_back();
  set_invalid(object.material);
  Fields fields(reading, at, "an object");
  if (!fields) {
    add_wrong_type(reading, at, R"(an object such as {"type": "sphere", ...})");
    return;
  }
  std::size_t type = 0;
  const bool type_known = fields.required("type", OneOf<std::size_t>{type, object_types});
  if (!type_known || object_types[type].first != tracer::Instance::type) fields.required("material", object.material);
  fields.optional("transform", object.transform);
  if (!type_known) return;  // its other fields depend on the type
  read_alternative(object.shape, type, [&](auto& shape) {
    fields.set_kind(shape.noun);
    if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, tracer::Mesh>) {
      read_mesh(reading, fields, object.shape);
    } else {
      read_shape(fields, shape);
    }
  });
  fields.finish();
}

void read_object_list(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  if (!within_limit(reading, at, "objects", reading.limits.scene.objects)) return;
  if (at.node->kind == json::Kind::array) objects.reserve(at.node->size);
  for_each_element(
      reading, at, [&](const Cursor& object) { read_object(reading, object, objects); },
      R"(a list of objects: [{"type": "sphere", ...}, ...])");
}

tracer::PrototypeId add_prototype(Reading& reading, const Cursor& at) {
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  prototypes.push_back({{}, pointer(at)});
  return {static_cast<std::uint32_t>(prototypes.size() - 1)};
}

}  // namespace

Transform composed(const Transform& then, const Transform& first) {
  Transform product;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const std::array<double, 4>& r = then.rows[i];
      product.rows[i][j] =
          r[0] * first.rows[0][j] + r[1] * first.rows[1][j] + r[2] * first.rows[2][j] + (j == 3 ? r[3] : 0.0);
    }
  return product;
}

bool read(Reading& reading, const Cursor& at, Transform& transform) {
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, R"(a list of steps such as [{"translate": [x, y, z]}], or a 4 x 4 matrix)");
  if (at.node->size > 0 && at.node[1].kind == json::Kind::array) return read_matrix(reading, at, transform);
  bool valid = true;
  for_each_element(reading, at, [&](const Cursor& element) {
    Transform step;
    valid &= read_step(reading, element, step);
    transform = composed(step, transform);
  });
  if (!valid) transform = {};
  return valid;
}

bool read(Reading& reading, const Cursor& at, tracer::PrototypeId& prototype) {
  set_invalid(prototype);
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "the name of a prototype");
  return find_name(reading, at, reading.prototypes, "prototypes", prototype);
}

void read_objects(Reading& reading, const Cursor& at) { read_object_list(reading, at, reading.scene().objects); }

void read_prototypes(Reading& reading, const Cursor& at) {
  // All names first, because an instance may stand before the prototype that it places; then the lists.
  reading.prototypes.complete = within_limit(reading, at, "objects", reading.limits.scene.objects);
  if (!reading.prototypes.complete) return;
  read_names(reading, at, reading.prototypes, add_prototype);
  if (!reading.prototypes.complete) return;
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  for_each_member(reading, at, [&](const Cursor& member) {
    // A duplicate's objects are read too, for their issues.
    read_object_list(reading, member, prototypes[reading.prototypes.ids[member.key].index].objects);
  });
}

}  // namespace api
