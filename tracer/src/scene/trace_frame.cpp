#include "tracer/src/scene/trace_frame.h"

namespace tracer {
namespace {

struct IncludeShape {
  Bounds& bounds;
  void operator()(const Sphere& sphere) const {
    const Vec3 r{sphere.radius, sphere.radius, sphere.radius};
    bounds.include(sphere.center - r);
    bounds.include(sphere.center + r);
  }
  void operator()(const Plane&) const {}
  void operator()(const Triangle& triangle) const {
    for (const Vec3& vertex : triangle.vertices) bounds.include(vertex);
  }
  void operator()(const Mesh& mesh) const {
    for (const Vec3& position : mesh.positions) bounds.include(position);
  }
};

}  // namespace

Bounds finite_bounds(const Scene& scene) {
  Bounds bounds;
  for (const Object& object : scene.objects) std::visit(IncludeShape{bounds}, object.shape);
  if (bounds.empty()) bounds.include(scene.camera.position);
  return bounds;
}

TraceFrame::TraceFrame(const Bounds& bounds) {
  const double extent = max_component(bounds.high - bounds.low);
  // A single point has no extent: any power of two will do, and one keeps lengths as they are.
  const int exponent = extent > 0 ? std::ilogb(extent) + 1 : 0;
  const double half = std::ldexp(1.0, exponent - 1);
  origin_ = extent > 0 ? bounds.low + Vec3{half, half, half} : bounds.low;
  scale_ = std::ldexp(1.0, -exponent);
  inverse_scale_ = std::ldexp(1.0, exponent);
}

}  // namespace tracer
