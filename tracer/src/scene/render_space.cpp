#include "tracer/src/scene/render_space.h"

#include <limits>

#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Corners of the bounding box of a transformed standard shape that itself lies within `box`.
void include_box(Bounds& bounds, const Affine& world_from_standard, const Bounds& box) {
  const auto& [low, high] = box;
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
    include_box(bounds, world_from_object * image.object_from_standard, local_box(quadric(image, {})));
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

/// Largest component of the edges of the smallest triangle, without those that are single points, scaled as the map
/// scales most.
double smallest_triangle(const Mesh& mesh, const Linear& map) {
  double smallest = HUGE_VAL;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &corner = mesh.positions[a], ab = mesh.positions[b] - corner, ac = mesh.positions[c] - corner;
    const double size = std::max(largest_component(ab), largest_component(ac));
    if (size > 0 && size < smallest) smallest = size;
  }
  return smallest * max_component(ellipsoid_extent(map));
}

}  // namespace

Bounds bounds_of(const Placed& placed) {
  Bounds bounds;
  std::visit(IncludeShape{bounds, placed.world_from_object}, placed.shape);
  return bounds;
}

FiniteBounds finite_bounds(const Scene& scene) {
  FiniteBounds extent;
  for_each_placed(scene, [&](const Placed& placed) {
    const Bounds box = bounds_of(placed);
    if (box.empty()) return;
    extent.include(box);
    const auto* mesh = std::get_if<Mesh>(&placed.shape);
    const double size =
        mesh == nullptr ? max_component(box.high - box.low) : smallest_triangle(*mesh, placed.world_from_object.linear);
    if (size > 0) extent.smallest = std::min(extent.smallest, size);
  });
  if (extent.empty()) extent.include(scene.camera.position);
  return extent;
}

float diagonal_of(const Placed& object) {
  const Bounds bounds = bounds_of(object);
  return bounds.empty() ? std::numeric_limits<float>::infinity() : static_cast<float>(length(bounds.high - bounds.low));
}

RenderSpace::RenderSpace(const FiniteBounds& bounds) {
  const double extent = max_component(bounds.high - bounds.low);
  // A single point has no extent: any power of two is valid, and 1 preserves lengths.
  int exponent = extent > 0 ? std::ilogb(extent) + 1 : 0;
  const double half = std::ldexp(1.0, exponent - 1);
  origin_ = extent > 0 ? bounds.low + Vec3{half, half, half} : bounds.low;
  if (bounds.is_mixed()) {
    const auto nearest = [](double low, double high) { return std::clamp(0.0, low, high); };
    origin_ = {nearest(bounds.low.x, bounds.high.x), nearest(bounds.low.y, bounds.high.y),
               nearest(bounds.low.z, bounds.high.z)};
    ++exponent;  // the scene may be on one side of it
  }
  scale_ = std::ldexp(1.0, -exponent);
  inverse_scale_ = std::ldexp(1.0, exponent);
}

}  // namespace tracer
