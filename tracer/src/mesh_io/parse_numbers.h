#pragma once
/// What every mesh reader asks of the numbers and polygons it meets. Each answer is the sentence that refuses them, or
/// empty when all is well.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace tracer::mesh_io {

std::string refusal_of(const Vec3& vector, const Limits& limits);  ///< positions and normals: |coordinate| in bounds
std::string refusal_of(const Vec2& uv, const Limits& limits);

/// Appends the triangles of a polygon, each three of `indices`; `corners` are its positions, in the same order.
std::string add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                        std::vector<std::array<std::uint32_t, 3>>& triangles);

std::string refusal_of_triangle_count(std::uint64_t count, const Limits& limits);

}  // namespace tracer::mesh_io
