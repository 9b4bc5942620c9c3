#pragma once
/// Unit disc: z = 0, radius_0 <= r <= 1.

#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

struct UnitDisc : StandardShape {
  static Bounds box(const Quadric&) { return {{-1, -1, 0}, {1, 1, 0}}; }
  static void include(Bounds& bounds, const Quadric& q) { bounds.include(q.origin, disc_extent(q.render_from_shape)); }

  /// Comparisons are closed, as those of all shapes, so that rims do not leak.
  static WHITTLE_INLINE QuadricHit hit(const ShapeRay& r, double inner) {
    QuadricHit hit;
    const double t = -r.oz / r.dz;
    const double x = r.ox + t * r.dx, y = r.oy + t * r.dy;
    const double squared = x * x + y * y;
    update_nearest(hit, t, (squared <= 1) & (squared >= inner * inner), QuadricPart::cap_1);
    return hit;
  }
  template <class Use>
  static WHITTLE_INLINE void with_hit(const Quadric& q, const Use& use) {
    use([inner = q.radius_0](const ShapeRay& ray) __attribute__((always_inline)) { return hit(ray, inner); });
  }

  static WHITTLE_INLINE ShapePoint point(double, double, double, const Vec3& p) { return {{p.x, p.y, 0}, {0, 0, 1}}; }
  static Vec2 uv(const Quadric&, QuadricPart, const Vec3& p) { return disc_uv(p, 1); }
  static UvGradients gradients(const Quadric&, QuadricPart, const Vec3&) { return disc_gradients(1); }
};

inline StandardImage<UnitDisc> standard_image(const Disc& disc) {
  return {round_about(disc.center, normalize(disc.normal) * disc.radius, disc.u_axis, disc.radius),
          disc.inner_radius / disc.radius};
}

inline double reach(const Disc& d) { return largest_component(d.center) + d.radius; }

template <class Checks>
void check(Checks& checks, const Disc& disc) {
  checks.less("inner_radius", disc.inner_radius, "the radius", disc.radius);
  checks.not_parallel("u_axis", disc.u_axis, disc.normal, "must not be parallel to the normal");
}

}  // namespace tracer
