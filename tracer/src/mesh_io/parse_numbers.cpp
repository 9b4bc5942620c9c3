#include "tracer/src/mesh_io/parse_numbers.h"

#include <charconv>
#include <cmath>

#include "tracer/triangulate.h"

namespace tracer::mesh_io {
namespace {

std::string text_of(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string vector_error(std::span<const double> numbers, double most, const char* limit) {
  for (const double number : numbers) {
    if (std::abs(number) <= most) continue;
    if (!std::isfinite(number)) return "must be finite, got " + text_of(number);
    return std::string("the limit ") + limit + " is " + text_of(most) + ", got " + text_of(number);
  }
  return "";
}

}  // namespace

std::string vector_error(const Vec3& vector, const Limits& limits) {
  return vector_error(std::array{vector.x, vector.y, vector.z}, limits.coordinate_max, "coordinate_max");
}

std::string vector_error(const Vec2& uv, const Limits& limits) {
  return vector_error(std::array{uv.x, uv.y}, limits.value_max, "value_max");
}

std::string add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                        std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (indices.size() < 3) return "a face must have at least 3 corners, has " + std::to_string(indices.size());
  if (auto failure = triangle_count_error(triangles.size() + indices.size() - 2, limits); !failure.empty())
    return failure;
  const std::size_t first = triangles.size();
  if (!triangulate(corners, triangles)) {
    return "the limit ear_clipping_corners_max is " + std::to_string(ear_clipping_corners_max) +
           " for faces that are no fan around their first corner (convex ones are), this one has " +
           std::to_string(indices.size());
  }
  for (std::size_t t = first; t < triangles.size(); ++t)
    for (std::uint32_t& corner : triangles[t]) corner = indices[corner];
  return "";
}

std::string triangle_count_error(std::uint64_t count, const Limits& limits) {
  if (count <= limits.triangles) return "";
  return "the limit triangles is " + std::to_string(limits.triangles) + ", it has at least " + std::to_string(count);
}

}  // namespace tracer::mesh_io
