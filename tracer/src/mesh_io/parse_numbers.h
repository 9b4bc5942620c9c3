#pragma once
/// Checks of numbers and polygons shared by all mesh readers. Each returns a sentence for an invalid value, or an empty
/// string.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace tracer::mesh_io {

std::string vector_error(const Vec3& vector, const Limits& limits);  ///< positions and normals: |coordinate| in bounds
std::string vector_error(const Vec2& uv, const Limits& limits);

/// Appends the triangles of a polygon as elements of `indices`; `corners` are its positions, in the same order.
std::string add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                        std::vector<std::array<std::uint32_t, 3>>& triangles);

std::string triangle_count_error(std::uint64_t count, const Limits& limits);

}  // namespace tracer::mesh_io
