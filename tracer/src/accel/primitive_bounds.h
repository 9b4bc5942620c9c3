#pragma once
/// Boxes of primitives.

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {

/// Box of a primitive, or of the points that a ray may report as its hit. Empty for a plane.
inline Bounds bounds_of(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  const auto [number, i] = primitive;
  Bounds box;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres: {
      const SphereGeometry& spheres = geometry.spheres[number];
      const double radius = spheres.radius[i];
      box.include({spheres.x[i], spheres.y[i], spheres.z[i]}, {radius, radius, radius});
      break;
    }
    case GeometryKind::triangles: {
      const TriangleGeometry& mesh = geometry.mesh(number);
      for (const std::uint32_t vertex : mesh.triangles[i]) box.include(mesh.position(vertex));
      break;
    }
    case GeometryKind::quadrics: {
      const Quadric& quadric = geometry.quadric_set(number).quadrics[i];
      visit_kind(quadric.kind, [&](auto standard) { standard.include(box, quadric); });
      break;
    }
    case GeometryKind::planes:
      return box;
  }
  // Rounding of the bounds above, and hits beyond a rim (rim_slack, StandardShape::error).
  const double slack = std::max(largest_component(box.low), largest_component(box.high)) * 0x1p-40;
  return {box.low - Vec3{slack, slack, slack}, box.high + Vec3{slack, slack, slack}};
}

}  // namespace tracer
