#pragma once
/// Triangulates polygons in space.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

/// Maximum number of corners of a polygon that is not a fan around its first corner: ear clipping takes quadratic time.
inline constexpr std::size_t ear_clipping_corners_max = 256;

/// Appends corners.size() - 2 triangles, indices into `corners`, with the polygon's winding. The polygon is projected
/// along its mean normal (Newell), so slightly non-planar polygons are valid. Uses a fan around the first corner if
/// that covers the polygon (every convex one), else ear clipping (Meisters 1975, "Polygons have ears"). The triangles
/// of a self-intersecting polygon are unspecified, and those of non-finite coordinates meaningless. Returns false and
/// appends nothing for fewer than 3 corners, or for more than ear_clipping_corners_max without a fan.
bool triangulate(std::span<const Vec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Appends the triangles of a polygon to the mesh, as elements of `indices`; `corners` are its positions, in the same
/// order. Returns false as triangulate() does.
bool add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, Mesh& mesh);

}  // namespace tracer
