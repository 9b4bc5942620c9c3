#include "tracer/src/interaction/ray_cone.h"

namespace tracer {

double curvature_at(const CompiledScene& scene, const PrimitiveRef& primitive) {
  const GeometrySet& set = scene.geometry();
  if (primitive.geometry < set.first_triangles())
    return 1 / set.spheres[primitive.geometry].radius[primitive.primitive];
  if (primitive.geometry < set.first_quadrics() || primitive.geometry >= set.plane_geometry()) return 0;
  const Quadric& quadric = set.quadrics[primitive.geometry - set.first_quadrics()].quadrics[primitive.primitive];
  const Linear& m = quadric.trace_from_shape;
  switch (quadric.kind) {
    case QuadricKind::ellipsoid:
      return 1 / std::min({length(m.x), length(m.y), length(m.z)});
    case QuadricKind::frustum:
      return 1 / (std::min(length(m.x), length(m.y)) * std::max(quadric.radius_0, quadric.radius_1));
    default:
      return 0;
  }
}

}  // namespace tracer
