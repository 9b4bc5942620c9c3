/// Transforms: a matrix, or steps that are multiplied here.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"
#include "api/src/reader/transform_product.h"

namespace api {
namespace {

using tracer::Transform;
using tracer::Vec3;
using Row = std::array<double, 4>;

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
  const bool has_axis = fields.required("axis", axis);
  const bool has_angle = fields.required("angle", angle);
  fields.finish();
  if (!has_axis || !has_angle) return false;
  if (axis.x == 0 && axis.y == 0 && axis.z == 0) {
    if (const auto place = fields.take("axis")) add_issue(reading, *place, "degenerate", "must not be the zero vector");
    return false;
  }
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

/// {"translate"} | {"rotate"} | {"scale"}: one of them.
bool read_step(Reading& reading, const Cursor& at, Transform& step) {
  Fields fields(reading, at, "a step of a transform");
  if (!fields) return false;
  int named = 0;
  bool valid = false;
  if (const auto translate = fields.take("translate")) {
    Vec3 by;
    valid = read(reading, *translate, by);
    if (valid) step.rows = {{{1, 0, 0, by.x}, {0, 1, 0, by.y}, {0, 0, 1, by.z}}};
    ++named;
  }
  if (const auto rotate = fields.take("rotate")) {
    valid = read_rotation(reading, *rotate, step);
    ++named;
  }
  if (const auto scale = fields.take("scale")) {
    valid = read_scale(reading, *scale, step);
    ++named;
  }
  fields.finish();
  if (named == 1) return valid;
  add_issue(reading, at, named == 0 ? "missing_field" : "conflict", "must hold one of translate, rotate, scale");
  return false;
}

bool read_matrix(Reading& reading, const Cursor& at, Transform& matrix) {
  std::array<Row, 4> rows{};
  if (!read(reading, at, rows)) return false;
  if (rows[3] != Row{0, 0, 0, 1}) {
    add_issue(reading, at, "out_of_range", "the last row must be [0, 0, 0, 1]: transforms are affine");
    return false;
  }
  matrix.rows = {rows[0], rows[1], rows[2]};
  return true;
}

}  // namespace

void read_transform(Reading& reading, const Cursor& at, std::optional<Transform>& transform) {
  Transform product;
  const bool is_list = at.node->kind == json::Kind::array;
  const bool holds_arrays = is_list && at.node->size > 0 && at.node[1].kind == json::Kind::array;
  bool valid = true;
  if (holds_arrays) {
    valid = read_matrix(reading, at, product);
  } else if (is_list) {
    for_each_element(reading, at, [&](const Cursor& element) {
      Transform step;
      const bool step_valid = read_step(reading, element, step);
      valid &= step_valid;
      if (step_valid) product = composed(step, product);
    });
  } else {
    add_wrong_type(reading, at, "a 4 x 4 matrix or a list of steps");
    valid = false;
  }
  if (valid) transform = product;
}

}  // namespace api
