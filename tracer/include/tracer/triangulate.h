#pragma once
/// Cuts a polygon in space into triangles.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

/// Polygons that are not a fan around their first corner may have this many corners: cutting off ears takes time
/// quadratic in it.
inline constexpr std::size_t ear_clipping_corners_max = 256;

/// Appends corners.size() - 2 triangles, indices into `corners`, wound as the polygon is. The polygon is seen along its
/// mean normal (Newell's), so slightly bent ones (quads of real meshes) are fine. A fan around the first corner where
/// that covers the polygon (every convex one), else ears cut off one by one (Meisters 1975, "Polygons have ears").
/// A polygon that meets itself gets triangles too, but which is left open. Coordinates that are not finite give
/// triangles that mean nothing.
/// Returns false, and appends nothing, for fewer than 3 corners or where it is no fan and has more corners than above.
bool triangulate(std::span<const Vec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace tracer
