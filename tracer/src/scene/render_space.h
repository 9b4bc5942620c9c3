#pragma once
/// Coordinate system of rays: world space translated so that the scene surrounds the origin, and scaled by a power of
/// two so that it spans about one unit. The scaling is exact, so an image is bit-identical under scaling by 2^k, and
/// Embree's float coordinates stay close to the origin and within the range in which its triangle tests are accurate.
/// Parts far smaller than the scene would be rounded away by the translation: such a scene keeps the document's own
/// origin, which rounds nothing, so that what is small there is exact however large the rest is.

#include "tracer/src/math/affine.h"

namespace tracer {

struct Placed;

/// Box of the object in world space; empty for a plane.
Bounds bounds_of(const Placed& placed);

/// Bounds of everything finite in the scene; of the camera's position when nothing is.
struct FiniteBounds : Bounds {
  double smallest = HUGE_VAL;  ///< size of the smallest object, or triangle of a mesh, within a small factor
  /// True if centering would round away digits of the smallest part.
  [[nodiscard]] bool is_mixed() const { return smallest < max_component(high - low) * 0x1p-24; }
};
FiniteBounds finite_bounds(const Scene& scene);

/// Diagonal of an object's bounding box in world space; infinite for planes. A float, so that copies at other places
/// are equal in spite of rounding.
float diagonal_of(const Placed& object);

class RenderSpace {
 public:
  /// The origin is low + 2^(e-1) on each axis, 2^e the smallest power of two that holds the extent: adding a power of
  /// two keeps it exact where a midpoint would round, so that a translated scene equals the pre-subtracted one. With
  /// parts of mixed sizes it is the point of the bounds nearest to the document's origin.
  explicit RenderSpace(const FiniteBounds& bounds);

  [[nodiscard]] Vec3 render_from_world(const Vec3& p) const { return (p - origin_) * scale_; }
  [[nodiscard]] Affine affine() const { return {{{scale_, 0, 0}, {0, scale_, 0}, {0, 0, scale_}}, origin_ * -scale_}; }
  [[nodiscard]] double render_from_world(double distance) const { return distance * scale_; }
  [[nodiscard]] double world_from_render(double distance) const { return distance * inverse_scale_; }

 private:
  Vec3 origin_;
  double scale_ = 1, inverse_scale_ = 1;
};

}  // namespace tracer
