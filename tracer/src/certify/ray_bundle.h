#pragma once
/// Rays of all positions in a block of pixels, and their intersections with primitives.

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/certify/affine_form.h"
#include "tracer/src/certify/convex_region.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Smallest box around all points.
inline Bounds box_of(const AffineVec& points) {
  const Interval x = points.x.range(), y = points.y.range(), z = points.z.range();
  return {{x.low, y.low, z.low}, {x.high, y.high, z.high}};
}

/// Rays origin + t direction, t > 0. Directions need not be unit.
struct RayBundle {
  AffineVec origin, direction;
};

/// Half-open rectangle of image positions, in pixels of the full image. Bundles cover its closure.
struct Block {
  double x0, y0, x1, y1;
};

/// Rays with the region that they run through.
struct Beam {
  RayBundle rays;
  ConvexRegion region;
  Vec3 axis;             ///< unit, through the center of the block
  bool forward = false;  ///< every ray advances along the axis

  /// Camera rays of a block.
  Beam(const CompiledCamera::LinearRays& camera, const Block& block);
};

/// Result of intersecting a bundle with a primitive.
struct BundleHit {
  enum class Kind {
    miss,     ///< no ray hits
    partial,  ///< some rays may hit
    cover     ///< all rays hit; the members below describe their nearest hits
  };
  Kind kind = Kind::partial;
  AffineForm t{};
  QuadricPart part{};   ///< the same for all rays; quadrics only
  bool back = false;    ///< back-face hits
  AffineForm u{}, v{};  ///< weights of the second and third vertex; triangles only
};

/// The primitive's hits as the accelerator finds them. A flat primitive is hit by rays that start on it: the caller
/// excludes these.
BundleHit intersect(const GeometrySet& geometry, const PrimitiveRef& primitive, const RayBundle& rays);

/// Hits of the plane z = 0 by rays o + t d with the forms o.z and d.z; `back` if they rise.
BundleHit plane_hit(const AffineForm& height, const AffineForm& rate);

/// True if the primitive is flat and none of the segments crosses its plane.
bool on_one_side(const GeometrySet& geometry, const PrimitiveRef& primitive, const AffineVec& from,
                 const AffineVec& to);

/// A point and a normal (any length) of a flat primitive; none for others.
struct PlaneOf {
  Vec3 point, normal;
};
std::optional<PlaneOf> plane_of(const GeometrySet& geometry, const PrimitiveRef& primitive);

}  // namespace tracer
