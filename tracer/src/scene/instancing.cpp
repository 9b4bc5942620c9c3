#include "tracer/src/scene/instancing.h"

namespace tracer {
namespace {

/// A round shape about `axis` (any length): e0 and e1 of length `radius`, and the axis as it is.
Affine round_about(const Vec3& origin, const Vec3& axis, const std::optional<Vec3>& u_axis, double radius) {
  const Axes axes = axes_across(normalize(axis), u_axis.value_or(Vec3{1, 0, 0}));
  return {{axes.e0 * radius, axes.e1 * radius, axis}, origin};
}

}  // namespace

Affine object_from_standard(const Sphere& sphere) {
  const Axes axes = axes_across(normalize(sphere.axis), sphere.meridian);
  return {{axes.e0 * sphere.radius, axes.e1 * sphere.radius, axes.n * sphere.radius}, sphere.center};
}

Affine object_from_standard(const Disc& disc) {
  return round_about(disc.center, normalize(disc.normal) * disc.radius, disc.u_axis, disc.radius);
}

Affine object_from_standard(const Cylinder& cylinder) {
  return round_about(cylinder.from, cylinder.to - cylinder.from, cylinder.u_axis, cylinder.radius);
}

Affine object_from_standard(const Cone& cone) {
  return round_about(cone.base, cone.apex - cone.base, cone.u_axis, std::max(cone.radius, cone.apex_radius));
}

Affine object_from_standard(const Box& box) {
  const Vec3 size = box.max - box.min;
  return {{{size.x, 0, 0}, {0, size.y, 0}, {0, 0, size.z}}, box.min};
}

}  // namespace tracer
