/// Transforms: a matrix, or steps whose product is computed here.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"
#include "api/src/reader/transform_product.h"

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
  if (!fields) return false;
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
  return add_issue(reading, at, count == 0 ? "missing_field" : "conflict", "must hold one of translate, rotate, scale");
}

bool read_matrix(Reading& reading, const Cursor& at, Transform& matrix) {
  std::array<std::array<double, 4>, 4> rows{};
  if (!read(reading, at, rows)) return false;
  if (rows[3] != std::array<double, 4>{0, 0, 0, 1})
    return add_issue(reading, at, "out_of_range", "the last row must be [0, 0, 0, 1]: transforms are affine");
  matrix.rows = {rows[0], rows[1], rows[2]};
  return true;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, Transform& transform) {
  if (at.node->kind != json::Kind::array) return add_wrong_type(reading, at, "a 4 x 4 matrix or a list of steps");
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

}  // namespace api
