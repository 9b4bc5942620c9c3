#include "tracer/src/shapes/quadric_surface.h"

#include <numbers>

#include "tracer/src/shapes/quadric_point.h"

namespace tracer {
namespace {

/// In [0,1): just below the seam, where adding one would round up to the next turn, it is the largest number below one.
double turns(double y, double x) {
  const double t = std::atan2(y, x) / (2 * std::numbers::pi);
  return t < 0 ? std::min(t + 1, 1 - 0x1p-53) : t;
}

ShapePoint shape_point(const Quadric& q, QuadricPart part, const Vec3& p) {
  switch (q.kind) {
    case QuadricKind::ellipsoid: {
      const Vec3 n = on_ball(p);
      return {n, n};
    }
    case QuadricKind::disc:
      return {{p.x, p.y, 0}, {0, 0, 1}};
    case QuadricKind::frustum:
      if (part == QuadricPart::cap_0) return {{p.x, p.y, 0}, {0, 0, -1}};
      if (part == QuadricPart::cap_1) return {{p.x, p.y, 1}, {0, 0, 1}};
      return on_side(q.radius_0, q.radius_1, p);
    case QuadricKind::box: {
      const Vec3 out = out_of_box(static_cast<double>(part));
      return {{on_box(out.x, p.x), on_box(out.y, p.y), on_box(out.z, p.z)}, out};
    }
  }
  return {};
}

Vec2 disc_uv(const Vec3& p, double radius) {
  return radius > 0 ? Vec2{p.x / (2 * radius) + 0.5, p.y / (2 * radius) + 0.5} : Vec2{0.5, 0.5};
}

/// A face seen from outside: u to the right, v up, where up is y (and away from the viewer on the top face).
Vec2 box_uv(QuadricPart part, const Vec3& p) {
  switch (part) {
    case QuadricPart::x_0:
      return {p.z, p.y};
    case QuadricPart::x_1:
      return {1 - p.z, p.y};
    case QuadricPart::y_0:
      return {p.x, p.z};
    case QuadricPart::y_1:
      return {p.x, 1 - p.z};
    case QuadricPart::z_0:
      return {1 - p.x, p.y};
    default:
      return {p.x, p.y};
  }
}

}  // namespace

Vec2 spherical_uv(const Vec3& n) {
  return {turns(n.y, n.x), 1 - std::atan2(std::hypot(n.x, n.y), n.z) / std::numbers::pi};
}

QuadricPoint quadric_point(const Quadric& quadric, QuadricPart part, const Vec3& on_ray) {
  const ShapePoint local = shape_point(quadric, part, quadric.shape_from_trace * (on_ray - quadric.origin));
  const PrimitivePoint at =
      placed(local, rims_of(quadric), quadric.origin, quadric.shape_from_trace, quadric.trace_from_shape);
  return {{at.position, at.error}, normalize(at.across)};
}

Vec2 quadric_uv(const Quadric& quadric, QuadricPart part, const Vec3& position) {
  const Vec3 p = quadric.shape_from_trace * (position - quadric.origin);
  switch (quadric.kind) {
    case QuadricKind::ellipsoid:
      return spherical_uv(p);
    case QuadricKind::disc:
      return disc_uv(p, 1);
    case QuadricKind::frustum:
      if (part == QuadricPart::cap_0) return disc_uv(p, quadric.radius_0);
      if (part == QuadricPart::cap_1) return disc_uv(p, quadric.radius_1);
      return {turns(p.y, p.x), std::clamp(p.z, 0.0, 1.0)};
    case QuadricKind::box:
      return box_uv(part, p);
  }
  return {};
}

}  // namespace tracer
