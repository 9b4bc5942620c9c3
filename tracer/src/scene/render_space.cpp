#include "tracer/src/scene/render_space.h"

#include <limits>

#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Corners of the bounding box of a transformed standard shape that itself lies within [low, high].
void include_box(Bounds& bounds, const Affine& world_from_standard, const Vec3& low, const Vec3& high) {
  for (int corner = 0; corner < 8; ++corner)
    bounds.include(world_from_standard.point(
        {(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y, (corner & 4) != 0 ? high.z : low.z}));
}

struct IncludeShape {
  Bounds& bounds;
  const Affine& world_from_object;

  void operator()(const Sphere& sphere) const {
    const Linear& m = world_from_object.linear;
    const Vec3 center = world_from_object.point(sphere.center);
    bounds.include(center, ellipsoid_extent(m) * sphere.radius);
  }
  template <Analytic S>
  void operator()(const S& shape) const {
    const auto image = standard_image(shape);
    const Bounds box = local_box(quadric(image, {}));
    include_box(bounds, world_from_object * image.object_from_standard, box.low, box.high);
  }
  void operator()(const Plane&) const {}
  void operator()(const Triangle& triangle) const {
    for (const Vec3& vertex : triangle.vertices) bounds.include(world_from_object.point(vertex));
  }
  void operator()(const Mesh& mesh) const {
    for (const Vec3& position : mesh.positions) bounds.include(world_from_object.point(position));
  }
  void operator()(const Instance&) const {}  // for_each_placed has resolved them
};

}  // namespace

void include(Bounds& bounds, const Placed& placed) {
  std::visit(IncludeShape{bounds, placed.world_from_object}, placed.shape);
}

Bounds finite_bounds(const Scene& scene) {
  Bounds bounds;
  for_each_placed(scene, [&](const Placed& placed) { include(bounds, placed); });
  if (bounds.empty()) bounds.include(scene.camera.position);
  return bounds;
}

float diagonal_of(const Placed& object) {
  Bounds bounds;
  std::visit(IncludeShape{bounds, object.world_from_object}, object.shape);
  return bounds.empty() ? std::numeric_limits<float>::infinity() : static_cast<float>(length(bounds.high - bounds.low));
}

RenderSpace::RenderSpace(const Bounds& bounds) {
  const double extent = max_component(bounds.high - bounds.low);
  // A single point has no extent: any power of two is valid, and 1 preserves lengths.
  const int exponent = extent > 0 ? std::ilogb(extent) + 1 : 0;
  const double half = std::ldexp(1.0, exponent - 1);
  origin_ = extent > 0 ? bounds.low + Vec3{half, half, half} : bounds.low;
  scale_ = std::ldexp(1.0, -exponent);
  inverse_scale_ = std::ldexp(1.0, exponent);
}

}  // namespace tracer
