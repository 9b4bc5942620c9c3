#pragma once
/// Triangles against bundles of rays, alone and as connected patches of a mesh.

#include <span>

#include "tracer/src/certify/ray_bundle.h"

namespace tracer {

BundleHit triangle_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays);

/// Hits of the triangle's plane, without barycentric coordinates.
BundleHit triangle_plane_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays);
/// The same with the coordinates, which may lie outside of the triangle.
BundleHit extended_triangle_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays);

/// True if the triangle lies outside of one of the region's half spaces.
bool is_outside(const TriangleGeometry& mesh, std::uint32_t triangle, const ConvexRegion& region);

/// True if every ray hits one of the triangles. They must be all that the rays may hit of their layer of a surface, and
/// all rays must cross their planes to the same side, as triangle_plane_hit() proves. Edges are shared if the positions
/// of their vertices are equal, in one mesh or in several.
///
/// A ray that hits the interior of a triangle has neighbors that do, too. So has one that hits an edge, if two of the
/// triangles traverse it in opposite directions: seen from one side, they lie on both sides of it. If no other edge
/// reaches into the region, the rays that hit are an open and closed set: all or none, and one proves that it is all.
bool covers(const GeometrySet& geometry, std::span<const PrimitiveRef> triangles, const Beam& bundle);

}  // namespace tracer
