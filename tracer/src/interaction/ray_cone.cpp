#include "tracer/src/interaction/ray_cone.h"

#include "tracer/src/shapes/registry.h"

namespace tracer {

double curvature_at(const CompiledScene& scene, const PrimitiveRef& primitive) {
  const GeometrySet& set = scene.geometry();
  if (primitive.geometry < set.first_triangles())
    return 1 / set.spheres[primitive.geometry].radius[primitive.primitive];
  if (primitive.geometry < set.first_quadrics() || primitive.geometry >= set.plane_geometry()) return 0;
  return curvature(set.quadrics[primitive.geometry - set.first_quadrics()].quadrics[primitive.primitive]);
}

}  // namespace tracer
