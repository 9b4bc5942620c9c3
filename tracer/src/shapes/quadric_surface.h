#pragma once
/// Points on analytic shapes: position with its error, normal, texture coordinates.

#include "tracer/src/accel/quadric.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

struct QuadricPoint {
  BoundedPoint point;  ///< trace frame
  Vec3 normal;         ///< unit, outward; a disc's is its own
};

/// `on_ray` is the hit point as the ray's arithmetic gives it, `part` what the intersection told.
QuadricPoint quadric_point(const Quadric& quadric, QuadricPart part, const Vec3& on_ray);

/// Texture coordinates of a point on the shape, as the scene document's table of objects gives them.
Vec2 quadric_uv(const Quadric& quadric, QuadricPart part, const Vec3& position);

/// u = phi/2pi in [0,1) about z from x towards y, v = 1 - theta/pi. By atan2 throughout: arccos would lose half the
/// digits at the poles. `n` need not be unit; poles have phi = 0.
Vec2 spherical_uv(const Vec3& n);

}  // namespace tracer
