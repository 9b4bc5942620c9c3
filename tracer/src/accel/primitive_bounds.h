#pragma once
/// Boxes of primitives.

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {

inline void include_primitive(Bounds& bounds, const SphereGeometry& g, std::uint32_t i) {
  bounds.include(g.center(i), {g.radius[i], g.radius[i], g.radius[i]});
}

inline void include_primitive(Bounds& bounds, const TriangleGeometry& geometry, std::uint32_t primitive) {
  for (const std::uint32_t vertex : geometry.triangles[primitive]) bounds.include(geometry.position(vertex));
}

inline void include_primitive(Bounds& bounds, const QuadricGeometry& geometry, std::uint32_t primitive) {
  const Quadric& q = geometry.quadrics[primitive];
  visit_kind(q.kind, [&](auto standard) { standard.include(bounds, q); });
}

inline void include_primitive(Bounds& /*bounds*/, const PlaneGeometry& /*planes*/, std::uint32_t /*plane*/) {}

/// Box of a primitive, or of the points that a ray may report as its hit. Empty for a plane.
inline Bounds bounds_of(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  Bounds box;
  geometry.visit(primitive.geometry, [&](const auto& one) { include_primitive(box, one, primitive.primitive); });
  if (box.empty()) return box;
  // Rounding of the bounds above, and hits beyond a rim (rim_slack, StandardShape::error).
  const double slack = std::max(largest_component(box.low), largest_component(box.high)) * 0x1p-40;
  return {box.low - Vec3{slack, slack, slack}, box.high + Vec3{slack, slack, slack}};
}

}  // namespace tracer
