#pragma once
/// Triangles against bundles of rays.

#include "tracer/src/certify/ray_bundle.h"

namespace tracer {

BundleHit triangle_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays);

/// True if the triangle lies outside of one of the region's half spaces.
bool is_outside(const TriangleGeometry& mesh, std::uint32_t triangle, const ConvexRegion& region);

}  // namespace tracer
