#include "tracer/src/certify/ray_bundle.h"

#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

using Kind = BundleHit::Kind;

/// a t^2 - 2 b t + c = 0; `discriminant` is b^2 - a c.
struct BundleQuadratic {
  AffineForm a, b, c, discriminant;
};

/// Hits of a closed convex surface with positive a: outside of it c is positive.
BundleHit first_root(const BundleQuadratic& q) {
  const Interval a = q.a.range(), b = q.b.range(), c = q.c.range(), d = q.discriminant.range();
  if (!(a.low > 0)) return {};
  if (d.high < 0 || (c.low > 0 && b.high < 0)) return {.kind = Kind::miss};
  if (!(d.low > 0)) return {};
  if (c.low > 0 && b.low > 0)
    return {.kind = Kind::cover, .t = q.c * inverse(q.b + square_root(q.discriminant)), .part = QuadricPart::side};
  if (c.high < 0)
    return {.kind = Kind::cover,
            .t = (q.b + square_root(q.discriminant)) * inverse(q.a),
            .part = QuadricPart::side,
            .back = true};
  return {};
}

/// f: origins from the center. The discriminant by Lagrange's identity: b^2 - a |f|^2 = -|f x d|^2 does not cancel.
BundleQuadratic sphere_quadratic(const AffineVec& f, const AffineVec& d, double radius) {
  const double squared_radius = radius * radius;
  const AffineForm a = squared_length(d);
  return {a, -dot(f, d), squared_length(f) - squared_radius, a * squared_radius - squared_length(cross(f, d))};
}

/// True if all hits are between these distances from the axis.
bool is_within(const AffineVec& o, const AffineVec& d, const BundleHit& hit, double inner, double outer) {
  if (hit.kind != Kind::cover) return false;
  const Interval squared_radius = (squared(o.x + d.x * hit.t) + squared(o.y + d.y * hit.t)).range();
  return squared_radius.high < outer * outer && (inner == 0 || squared_radius.low > inner * inner);
}

BundleHit disc_hit(const AffineVec& o, const AffineVec& d, double inner) {
  const BundleHit hit = plane_hit(o.z, d.z);
  return hit.kind == Kind::miss || is_within(o, d, hit, inner, 1) ? hit : BundleHit{};
}

const AffineForm& component(const AffineVec& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// From outside the rays enter the cube through faces that face the origins.
BundleHit cube_hit(const AffineVec& o, const AffineVec& d) {
  for (int axis = 0; axis < 3; ++axis) {
    const Interval range = component(o, axis).range();
    if (!(range.high < 0) && !(range.low > 1)) continue;
    const bool high = range.low > 1;
    BundleHit hit = plane_hit(component(o, axis) - (high ? 1 : 0), component(d, axis));
    if (hit.kind == Kind::miss) return hit;
    if (hit.kind != Kind::cover) continue;
    const auto is_inside = [&](int other) {
      const Interval across = (component(o, other) + component(d, other) * hit.t).range();
      return across.low > 0 && across.high < 1;
    };
    if (!is_inside((axis + 1) % 3) || !is_inside((axis + 2) % 3)) continue;
    hit.part = static_cast<QuadricPart>(static_cast<int>(QuadricPart::x_0) + 2 * axis + (high ? 1 : 0));
    hit.back = false;
    return hit;
  }
  return {};
}

/// From outside: a hit of the side, or of a cap from beyond its plane, is where the ray enters the convex solid.
BundleHit frustum_hit(const Quadric& q, const AffineVec& o, const AffineVec& d) {
  const Interval z = o.z.range();
  for (const bool top : {false, true}) {
    if (!q.caps || !(top ? z.low > 1 : z.high < 0)) continue;
    BundleHit cap = plane_hit(top ? o.z - 1 : o.z, d.z);
    if (!is_within(o, d, cap, 0, top ? q.radius_1 : q.radius_0)) continue;
    cap.part = top ? QuadricPart::cap_1 : QuadricPart::cap_0;
    cap.back = false;
    return cap;
  }
  const double slope = q.radius_1 - q.radius_0;
  const AffineForm radius = o.z * slope + q.radius_0, growth = d.z * slope;
  const AffineForm over_x = o.x * growth - radius * d.x, over_y = o.y * growth - radius * d.y;
  const AffineForm turn = o.x * d.y - o.y * d.x;
  const BundleHit side =
      first_root({squared(d.x) + squared(d.y) - squared(growth), radius * growth - o.x * d.x - o.y * d.y,
                  squared(o.x) + squared(o.y) - squared(radius), squared(over_x) + squared(over_y) - squared(turn)});
  // A ray that misses the infinite cone misses the caps in it.
  if (side.kind == Kind::miss) return side;
  if (side.kind != Kind::cover || side.back) return {};
  const Interval at = (o.z + d.z * side.t).range();
  if (at.low > 0 && at.high < 1) return side;
  return {};
}

/// True if the columns span more than 2^-6 of the product of their lengths: the inverse, by cofactors, then has an
/// error below 2^-44 of its columns' lengths.
bool is_accurate(const Linear& m) {
  const double volume = determinant(m);
  return volume * volume > 0x1p-12 * dot(m.x, m.x) * dot(m.y, m.y) * dot(m.z, m.z);
}

BundleHit quadric_hit(const Quadric& q, const RayBundle& rays) {
  if (!is_accurate(q.render_from_shape)) return {};
  const AffineVec o = q.shape_from_render * (rays.origin - q.origin), d = q.shape_from_render * rays.direction;
  if (q.kind == kind_of<UnitSphere>) return first_root(sphere_quadratic(o, d, 1));
  if (q.kind == kind_of<UnitDisc>) return disc_hit(o, d, q.radius_0);
  if (q.kind == kind_of<Frustum>) return frustum_hit(q, o, d);
  if (q.kind == kind_of<UnitCube>) return cube_hit(o, d);
  return {};
}

/// A triangle is hit where the signed volumes of the tetrahedra between the ray and its edges have the sign of its side
/// (Pluecker coordinates).
BundleHit triangle_hit(const TriangleGeometry& mesh, std::uint32_t triangle, const RayBundle& rays) {
  const auto& vertices = mesh.triangles[triangle];
  const Vec3 a = mesh.position(vertices[0]), b = mesh.position(vertices[1]), c = mesh.position(vertices[2]);
  const AffineVec from_a = rays.origin - a, from_b = rays.origin - b, from_c = rays.origin - c;
  const Vec3 to_b = b - a, to_c = c - a, normal = cross(to_b, to_c);
  const double rounding = length(to_b) * length(to_c) * form_rounding;
  AffineForm height = dot(from_a, normal), rate = dot(rays.direction, normal);
  height.error += rounding * magnitude(from_a);
  rate.error += rounding * magnitude(rays.direction);
  BundleHit hit = plane_hit(height, rate);
  if (hit.kind == Kind::miss) return hit;
  const auto edge = [&](const AffineVec& p, const AffineVec& q) { return dot(rays.direction, cross(p, q)); };
  const AffineForm at_a = edge(from_b, from_c), at_b = edge(from_c, from_a), at_c = edge(from_a, from_b);
  const Interval range_a = at_a.range(), range_b = at_b.range(), range_c = at_c.range();
  const bool any_positive = range_a.low > 0 || range_b.low > 0 || range_c.low > 0;
  const bool any_negative = range_a.high < 0 || range_b.high < 0 || range_c.high < 0;
  if (any_positive && any_negative) return {.kind = Kind::miss};
  if (hit.kind != Kind::cover) return {};
  // At a front-face hit the volumes are negative: d points against the normal.
  if (hit.back ? any_negative : any_positive) return {.kind = Kind::miss};
  const bool inside = hit.back ? range_a.low > 0 && range_b.low > 0 && range_c.low > 0
                               : range_a.high < 0 && range_b.high < 0 && range_c.high < 0;
  if (!inside) return {};
  const AffineForm scale = inverse(at_a + at_b + at_c);
  hit.u = at_b * scale;
  hit.v = at_c * scale;
  hit.part = {};
  return hit;
}

/// Precondition: no lens, and rays are linear.
RayBundle camera_rays(const CompiledCamera::LinearRays& camera, const Block& block) {
  const double x = 0.5 * (block.x0 + block.x1), y = 0.5 * (block.y0 + block.y1);
  const double half_x = 0.5 * (block.x1 - block.x0), half_y = 0.5 * (block.y1 - block.y0);
  const auto form = [&](double base, double along_x, double along_y) {
    if (along_x == 0 && along_y == 0) return exactly(base);
    const double size = std::abs(base) + std::abs(along_x * x) + std::abs(along_y * y);
    return AffineForm{base + along_x * x + along_y * y, along_x * half_x, along_y * half_y, size * form_rounding};
  };
  const auto forms = [&](const Vec3& base, const Vec3& along_x, const Vec3& along_y) {
    return AffineVec{form(base.x, along_x.x, along_y.x), form(base.y, along_x.y, along_y.y),
                     form(base.z, along_x.z, along_y.z)};
  };
  return {forms(camera.origin, camera.origin_x, camera.origin_y),
          forms(camera.direction, camera.direction_x, camera.direction_y)};
}

}  // namespace

BundleHit plane_hit(const AffineForm& height, const AffineForm& rate) {
  const Interval h = height.range(), r = rate.range();
  const bool above = h.low > 0, below = h.high < 0, falls = r.high<0, rises = r.low> 0;
  if ((above && r.low >= 0) || (below && r.high <= 0)) return {.kind = Kind::miss};
  if ((above && falls) || (below && rises))
    return {.kind = Kind::cover, .t = -height * inverse(rate), .part = QuadricPart::cap_1, .back = rises};
  return {};
}

Beam::Beam(const CompiledCamera::LinearRays& camera, const Block& block) : rays(camera_rays(camera, block)) {
  const Vec3 origin = center(rays.origin), direction = center(rays.direction);
  axis = normalize(direction);
  forward = dot(rays.direction, axis).range().low > 0;
  if (forward) region.cut(axis, origin);
  // The plane of each side of the block contains the rays of its corners.
  const auto cut_sides = [&](const Vec3& origin_along, const Vec3& direction_along, const Vec3& origin_across,
                             const Vec3& direction_across) {
    for (const double side : {-1.0, 1.0}) {
      const Vec3 corner = origin + origin_across * side, ray = direction + direction_across * side;
      const Vec3 normal = cross(origin_along + direction_along, ray);
      const double outward = dot(normal, origin_across + direction_across) * side;
      region.cut(outward > 0 ? -normal : normal, corner);
    }
  };
  const Vec3 ox = slope_x(rays.origin), oy = slope_y(rays.origin);
  const Vec3 dx = slope_x(rays.direction), dy = slope_y(rays.direction);
  cut_sides(ox, dx, oy, dy);
  cut_sides(oy, dy, ox, dx);
}

BundleHit intersect(const GeometrySet& geometry, const PrimitiveRef& primitive, const RayBundle& rays) {
  const auto [number, i] = primitive;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres: {
      const SphereGeometry& spheres = geometry.spheres[number];
      return first_root(sphere_quadratic(rays.origin - spheres.center(i), rays.direction, spheres.radius[i]));
    }
    case GeometryKind::triangles:
      return triangle_hit(geometry.mesh(number), i, rays);
    case GeometryKind::quadrics:
      return quadric_hit(geometry.quadric_set(number).quadrics[i], rays);
    case GeometryKind::planes:
      break;
  }
  const Vec3 point = geometry.planes.point[i], normal = geometry.planes.normal[i];
  return plane_hit(dot(rays.origin - point, normal), dot(rays.direction, normal));
}

std::optional<PlaneOf> plane_of(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  const auto [number, i] = primitive;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres:
      return std::nullopt;
    case GeometryKind::triangles: {
      const TriangleGeometry& mesh = geometry.mesh(number);
      const auto& [a, b, c] = mesh.triangles[i];
      const Vec3 point = mesh.position(a);
      return PlaneOf{point, cross(mesh.position(b) - point, mesh.position(c) - point)};
    }
    case GeometryKind::quadrics: {
      const Quadric& q = geometry.quadric_set(number).quadrics[i];
      if (q.kind != kind_of<UnitDisc>) return std::nullopt;
      return PlaneOf{q.origin, transposed(q.shape_from_render) * Vec3{0, 0, 1}};
    }
    case GeometryKind::planes:
      break;
  }
  return PlaneOf{geometry.planes.point[i], geometry.planes.normal[i]};
}

bool on_one_side(const GeometrySet& geometry, const PrimitiveRef& primitive, const AffineVec& from,
                 const AffineVec& to) {
  const std::optional<PlaneOf> plane = plane_of(geometry, primitive);
  if (!plane) return false;
  const Interval first = dot(from - plane->point, plane->normal).range();
  const Interval second = dot(to - plane->point, plane->normal).range();
  return (first.low > 0 && second.low > 0) || (first.high < 0 && second.high < 0);
}

}  // namespace tracer
