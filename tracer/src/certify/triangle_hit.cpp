#include "tracer/src/certify/triangle_hit.h"

namespace tracer {
namespace {

using Kind = BundleHit::Kind;

double sum(const Vec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

/// Rounding of a cross product per unit of its other factor: of the difference of p and q, and of the product.
double cross_rounding(const Vec3& p, const Vec3& q, const Vec3& difference) {
  return (sum(p) + sum(q) + sum(difference)) * form_rounding;
}

/// Signed volumes of the tetrahedra between a ray and the edges of a triangle (Pluecker coordinates): for one of its
/// edges (p, q) d.(p-o) x (q-o), which is linear in o and in d.
class EdgeForms {
 public:
  explicit EdgeForms(const RayBundle& rays) : direction_(rays.direction), center_(center(rays.origin)) {
    shift_ = rays.origin - center_;
    fixed_ = shift_.x.radius() + shift_.y.radius() + shift_.z.radius() == 0;
  }

  [[nodiscard]] AffineForm operator()(const Vec3& p, const Vec3& q) const {
    const Vec3 to_p = p - center_, to_q = q - center_, across = cross(to_p, to_q);
    const double rounding = cross_rounding(p, center_, to_p) * sum(to_q) + cross_rounding(q, center_, to_q) * sum(to_p);
    AffineForm volume = dot(direction_, across);
    if (!fixed_) volume = volume + dot(shift_, cross(p - q, direction_));
    volume.error += rounding * magnitude(direction_);
    return volume;
  }

 private:
  const AffineVec& direction_;
  Vec3 center_;
  AffineVec shift_;  ///< differences of the origins from their center
  bool fixed_;
};

/// Corners of a triangle.
struct Corners3 {
  Vec3 a, b, c;
  Corners3(const TriangleGeometry& mesh, std::uint32_t triangle) {
    const auto& vertices = mesh.triangles[triangle];
    a = mesh.position(vertices[0]);
    b = mesh.position(vertices[1]);
    c = mesh.position(vertices[2]);
  }
};

BundleHit corners_plane_hit(const Corners3& corners, const RayBundle& rays) {
  const auto& [a, b, c] = corners;
  const Vec3 to_b = b - a, to_c = c - a, normal = cross(to_b, to_c);
  const AffineVec from_a = rays.origin - a;
  AffineForm height = dot(from_a, normal), rate = dot(rays.direction, normal);
  const double rounding = cross_rounding(a, b, to_b) * sum(to_c) + cross_rounding(a, c, to_c) * sum(to_b);
  height.error += rounding * magnitude(from_a);
  rate.error += rounding * magnitude(rays.direction);
  return plane_hit(height, rate);
}

BundleHit with_weights(BundleHit plane, const AffineForm& at_a, const AffineForm& at_b, const AffineForm& at_c) {
  const AffineForm scale = inverse(at_a + at_b + at_c);
  plane.u = at_b * scale;
  plane.v = at_c * scale;
  plane.part = {};
  return plane;
}

}  // namespace

BundleHit triangle_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays) {
  const Corners3 corners(mesh, triangle);
  const BundleHit plane = corners_plane_hit(corners, rays);
  if (plane.kind == Kind::miss) return plane;
  const EdgeForms edge(rays);
  const auto& [a, b, c] = corners;
  const AffineForm at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
  const Interval range_a = at_a.range(), range_b = at_b.range(), range_c = at_c.range();
  const bool any_positive = range_a.low > 0 || range_b.low > 0 || range_c.low > 0;
  const bool any_negative = range_a.high < 0 || range_b.high < 0 || range_c.high < 0;
  if (any_positive && any_negative) return {.kind = Kind::miss};
  if (plane.kind != Kind::cover) return {};
  // At a front-face hit the volumes are negative: d points against the normal.
  if (plane.back ? any_negative : any_positive) return {.kind = Kind::miss};
  const bool inside = plane.back ? range_a.low > 0 && range_b.low > 0 && range_c.low > 0
                                 : range_a.high < 0 && range_b.high < 0 && range_c.high < 0;
  if (!inside) return {};
  return with_weights(plane, at_a, at_b, at_c);
}

bool is_outside(const TriangleGeometry& mesh, std::uint32_t triangle, const ConvexRegion& region) {
  const Corners3 corners(mesh, triangle);
  return std::any_of(region.begin(), region.end(), [&](const HalfSpace& half) {
    const Vec3 normal{half.x, half.y, half.z};
    return dot(normal, corners.a) < half.limit && dot(normal, corners.b) < half.limit &&
           dot(normal, corners.c) < half.limit;
  });
}

}  // namespace tracer
