#include "tracer/src/shapes/quadric_surface.h"

#include <numbers>

namespace tracer {
namespace {

/// In the shape's own space; the normal need not be unit.
struct ShapePoint {
  Vec3 position, normal;
};

/// In [0,1): just below the seam, where adding one would round up to the next turn, it is the largest number below one.
double turns(double y, double x) {
  const double t = std::atan2(y, x) / (2 * std::numbers::pi);
  return t < 0 ? std::min(t + 1, 1 - 0x1p-53) : t;
}

ShapePoint on_side(const Quadric& q, const Vec3& p) {
  const double z = std::clamp(p.z, 0.0, 1.0);
  const double slope = q.radius_1 - q.radius_0;
  const double radius = q.radius_0 + slope * z;
  const double r = std::hypot(p.x, p.y);
  // The apex has no normal of its own: it looks along the axis.
  if (!(r > 0) || !(radius > 0)) return {{0, 0, z}, {0, 0, slope < 0 ? 1.0 : -1.0}};
  const Vec3 round{p.x / r, p.y / r, 0};
  return {{round.x * radius, round.y * radius, z}, {round.x, round.y, -slope}};
}

ShapePoint on_box(QuadricPart part, const Vec3& p) {
  const Vec3 inside{std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0), std::clamp(p.z, 0.0, 1.0)};
  switch (part) {
    case QuadricPart::x_0:
      return {{0, inside.y, inside.z}, {-1, 0, 0}};
    case QuadricPart::x_1:
      return {{1, inside.y, inside.z}, {1, 0, 0}};
    case QuadricPart::y_0:
      return {{inside.x, 0, inside.z}, {0, -1, 0}};
    case QuadricPart::y_1:
      return {{inside.x, 1, inside.z}, {0, 1, 0}};
    case QuadricPart::z_0:
      return {{inside.x, inside.y, 0}, {0, 0, -1}};
    default:
      return {{inside.x, inside.y, 1}, {0, 0, 1}};
  }
}

ShapePoint shape_point(const Quadric& q, QuadricPart part, const Vec3& p) {
  switch (q.kind) {
    case QuadricKind::ellipsoid: {
      const Vec3 n = normalize(p);
      return {n, n};
    }
    case QuadricKind::disc:
      return {{p.x, p.y, 0}, {0, 0, 1}};
    case QuadricKind::frustum:
      if (part == QuadricPart::cap_0) return {{p.x, p.y, 0}, {0, 0, -1}};
      if (part == QuadricPart::cap_1) return {{p.x, p.y, 1}, {0, 0, 1}};
      return on_side(q, p);
    case QuadricKind::box:
      return on_box(part, p);
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

Linear absolute(const Linear& m) { return {abs(m.x), abs(m.y), abs(m.z)}; }

}  // namespace

Vec2 spherical_uv(const Vec3& n) {
  return {turns(n.y, n.x), 1 - std::atan2(std::hypot(n.x, n.y), n.z) / std::numbers::pi};
}

QuadricPoint quadric_point(const Quadric& quadric, QuadricPart part, const Vec3& on_ray) {
  const ShapePoint local = shape_point(quadric, part, quadric.shape_from_trace * (on_ray - quadric.origin));
  const Vec3 arm = quadric.trace_from_shape * local.position;
  const Vec3 position = quadric.origin + arm;
  // What mapping the point there and its next ray back can be wrong by: both maps with their absolute entries. Side and
  // caps reach beyond their rim by rim_slack: a ray that leaves one must start clear of the other.
  const bool has_rims = quadric.kind == QuadricKind::frustum && quadric.caps;
  const double bound = rounding_bound(16) + (has_rims ? 2 * rim_slack : 0);
  const Vec3 reach = absolute(quadric.shape_from_trace) * abs(arm) + Vec3{1, 1, 1};
  const Vec3 error =
      absolute(quadric.trace_from_shape) * reach * bound + (abs(position) + abs(quadric.origin)) * rounding_bound(2);
  return {{position, error}, normalize(transformed_normal(quadric.trace_from_shape, local.normal))};
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
