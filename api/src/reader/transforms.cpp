/// Transforms: matrices, lists of steps, and `position`, `rotate` and `scale` of an object.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "api/reader/fields.h"
#include "api/src/reader/sections.h"

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

/// Appends a rotation: about an axis, or by angles about x, then y, then z (degrees).
bool append_rotation(Reading& reading, const Cursor& at, Transform& transform) {
  if (at.node->kind == json::Kind::array) {
    Vec3 angles;
    if (!read(reading, at, angles)) return false;
    transform = composed(rotation({1, 0, 0}, angles.x), transform);
    transform = composed(rotation({0, 1, 0}, angles.y), transform);
    transform = composed(rotation({0, 0, 1}, angles.z), transform);
    return true;
  }
  if (at.node->kind != json::Kind::object)
    return add_wrong_type(reading, at, R"([x, y, z] in degrees or {"axis": [x, y, z], "angle": DEGREES})");
  Vec3 axis;
  double angle = 0;
  Fields fields(reading, at, "a rotation");
  const auto axis_field = fields.take_required("axis", form_of<Vec3>);
  const bool has_axis = axis_field && read(reading, *axis_field, axis);
  const bool has_angle = fields.required("angle", angle);
  fields.finish();
  if (!has_axis || !has_angle) return false;
  if (axis.x == 0 && axis.y == 0 && axis.z == 0)
    return add_issue(reading, *axis_field, "degenerate", "must not be the zero vector");
  transform = composed(rotation(axis, angle), transform);
  return true;
}

bool append_scale(Reading& reading, const Cursor& at, Transform& transform) {
  Vec3 scale;
  if (!read_per_axis(reading, at, scale)) return false;
  transform = composed({{{{scale.x, 0, 0, 0}, {0, scale.y, 0, 0}, {0, 0, scale.z, 0}}}}, transform);
  return true;
}

bool append_translation(Reading& reading, const Cursor& at, Transform& transform) {
  Vec3 by;
  if (!read(reading, at, by)) return false;
  transform = composed({{{{1, 0, 0, by.x}, {0, 1, 0, by.y}, {0, 0, 1, by.z}}}}, transform);
  return true;
}

/// Appends an object with exactly one of the members translate, rotate and scale.
bool append_step(Reading& reading, const Cursor& at, Transform& transform) {
  Fields fields(reading, at, "a step of a transform");
  if (!fields)
    return add_wrong_type(reading, at, R"({"translate": [x, y, z]}, {"rotate": [x, y, z]} or {"scale": NUMBER})");
  int count = 0;
  bool valid = false;
  for (const auto& [name, append] :
       {std::pair{"translate", &append_translation}, {"rotate", &append_rotation}, {"scale", &append_scale}}) {
    const auto field = fields.take(name);
    if (!field) continue;
    valid = append(reading, *field, transform);
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

/// Checked here, because tracer::validate has no field but `transform`.
bool check_placement(Reading& reading, const Cursor& at, const Transform& placement) {
  for (const auto& row : placement.rows) {
    if (row[0] == 0 && row[1] == 0 && row[2] == 0)
      return add_issue(reading, at, "degenerate", "must not be 0: the object would be flat");
    for (const double entry : row)
      if (std::abs(entry) > reading.limits.scene.coordinate_max)
        return add_issue(reading, at, "limit_exceeded", "exceeds the limit coordinate_max");
  }
  return true;
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
  for_each_element(reading, at, [&](const Cursor& element) { valid &= append_step(reading, element, transform); });
  if (!valid) transform = {};
  return valid;
}

bool read_per_axis(Reading& reading, const Cursor& at, Vec3& value) {
  if (at.node->kind != json::Kind::number) return read(reading, at, value);
  if (!read(reading, at, value.x)) return false;
  value.y = value.z = value.x;
  return true;
}

void read_placement(Reading& reading, Fields& fields, std::optional<Transform>& transform) {
  const bool has_transform = fields.has("transform");
  fields.optional("transform", transform);
  Transform placement;
  bool valid = true, any = false;
  for (const auto& [name, append] :
       {std::pair{"scale", &append_scale}, {"rotate", &append_rotation}, {"position", &append_translation}}) {
    const auto field = fields.take(name);
    if (!field) continue;
    any = true;
    if (has_transform)
      valid = add_issue(reading, *field, "conflict", "must not be combined with \"transform\"");
    else if (!append(reading, *field, placement))
      valid = false;
    else
      valid &= check_placement(reading, *field, placement);
  }
  if (any && valid) transform = placement;
}

}  // namespace api
