#pragma once
/// Textbook ray-shape intersections for BareEmbree, in double precision without error bounds. Each returns the smallest
/// distance > `near`, or infinity; ray directions need not be unit vectors.

#include <cmath>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/shapes/shape_registry.h"

namespace bench {

#define BARE_INLINE inline __attribute__((always_inline))

struct BareRay {
  double ox, oy, oz, dx, dy, dz, near;
};

BARE_INLINE double lower(double a, double b) { return a < b ? a : b; }
BARE_INLINE double higher(double a, double b) { return a < b ? b : a; }

BARE_INLINE double first_beyond(double near, double a, double b) {
  const double first = lower(a, b), second = higher(a, b);
  return first > near ? first : (second > near ? second : HUGE_VAL);
}

BARE_INLINE double sphere_distance(const BareRay& r, double radius) {
  const double a = r.dx * r.dx + r.dy * r.dy + r.dz * r.dz;
  const double b = r.ox * r.dx + r.oy * r.dy + r.oz * r.dz;
  const double c = r.ox * r.ox + r.oy * r.oy + r.oz * r.oz - radius * radius;
  const double discriminant = b * b - a * c;
  const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
  const double t = first_beyond(r.near, (-b - root) / a, (-b + root) / a);
  return discriminant >= 0 ? t : HUGE_VAL;
}

BARE_INLINE double disc_distance(const BareRay& r, double z, double inner, double outer) {
  const double t = (z - r.oz) / r.dz;
  const double x = r.ox + t * r.dx, y = r.oy + t * r.dy, squared = x * x + y * y;
  return (t > r.near) & (squared <= outer * outer) & (squared >= inner * inner) ? t : HUGE_VAL;
}

template <bool caps>
BARE_INLINE double frustum_distance(const BareRay& r, double radius_0, double radius_1) {
  const double slope = radius_1 - radius_0;
  const double radius = radius_0 + slope * r.oz, growth = slope * r.dz;
  const double a = r.dx * r.dx + r.dy * r.dy - growth * growth;
  const double b = r.ox * r.dx + r.oy * r.dy - radius * growth;
  const double c = r.ox * r.ox + r.oy * r.oy - radius * radius;
  const double discriminant = b * b - a * c;
  const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
  const auto side = [&](double t) __attribute__((always_inline)) {
    const double z = r.oz + t * r.dz;
    return (discriminant >= 0) & (t > r.near) & (z >= 0) & (z <= 1) ? t : HUGE_VAL;
  };
  double t = lower(side((-b - root) / a), side((-b + root) / a));
  if (caps) t = lower(t, lower(disc_distance(r, 0, 0, radius_0), disc_distance(r, 1, 0, radius_1)));
  return t;
}

BARE_INLINE double box_distance(const BareRay& r) {
  double enter = -HUGE_VAL, leave = HUGE_VAL;
  const auto slab = [&](double o, double d) __attribute__((always_inline)) {
    const double low = -o / d, high = (1 - o) / d;
    enter = higher(enter, lower(low, high));
    leave = lower(leave, higher(low, high));
  };
  slab(r.ox, r.dx);
  slab(r.oy, r.dy);
  slab(r.oz, r.dz);
  return enter <= leave ? first_beyond(r.near, enter, leave) : HUGE_VAL;
}

/// Calls `all(distance)`, where `distance(ray)` intersects a render-space ray. The shape is selected once per call.
template <class All>
BARE_INLINE void with_shape(const tracer::SphereGeometry& g, unsigned i, const All& all) {
  const double x = g.x[i], y = g.y[i], z = g.z[i], radius = g.radius[i];
  all([=](const BareRay& r) __attribute__((always_inline)) {
    return sphere_distance({r.ox - x, r.oy - y, r.oz - z, r.dx, r.dy, r.dz, r.near}, radius);
  });
}

template <class All>
BARE_INLINE void with_shape(const tracer::QuadricGeometry& g, unsigned i, const All& all) {
  const tracer::Quadric& q = g.quadrics[i];
  const tracer::Linear m = q.shape_from_render;
  const tracer::Vec3 origin = q.origin;
  const double radius_0 = q.radius_0, radius_1 = q.radius_1;
  const auto to_shape_space = [=](const BareRay& r) __attribute__((always_inline)) {
    const double x = r.ox - origin.x, y = r.oy - origin.y, z = r.oz - origin.z;
    return BareRay{m.x.x * x + m.y.x * y + m.z.x * z,
                   m.x.y * x + m.y.y * y + m.z.y * z,
                   m.x.z * x + m.y.z * y + m.z.z * z,
                   m.x.x * r.dx + m.y.x * r.dy + m.z.x * r.dz,
                   m.x.y * r.dx + m.y.y * r.dy + m.z.y * r.dz,
                   m.x.z * r.dx + m.y.z * r.dy + m.z.z * r.dz,
                   r.near};
  };
  switch (q.kind) {
    case tracer::kind_of<tracer::UnitSphere>:
      return all([=](const BareRay& r)
                     __attribute__((always_inline)) { return sphere_distance(to_shape_space(r), 1); });
    case tracer::kind_of<tracer::UnitDisc>:
      return all([=](const BareRay& r)
                     __attribute__((always_inline)) { return disc_distance(to_shape_space(r), 0, radius_0, 1); });
    case tracer::kind_of<tracer::Frustum>:
      if (q.caps)
        return all([=](const BareRay& r) __attribute__((always_inline)) {
          return frustum_distance<true>(to_shape_space(r), radius_0, radius_1);
        });
      return all([=](const BareRay& r) __attribute__((always_inline)) {
        return frustum_distance<false>(to_shape_space(r), radius_0, radius_1);
      });
    case tracer::kind_of<tracer::UnitCube>:
      return all([=](const BareRay& r) __attribute__((always_inline)) { return box_distance(to_shape_space(r)); });
    default:  // the benches' scenes have no torus
      return all([](const BareRay&) { return HUGE_VAL; });
  }
}

/// Conservative bounds: center and half extents.
struct BareBounds {
  tracer::Vec3 center, extent;
};

inline BareBounds bounds_of(const tracer::SphereGeometry& g, unsigned i) {
  return {{g.x[i], g.y[i], g.z[i]}, {g.radius[i], g.radius[i], g.radius[i]}};
}

inline BareBounds bounds_of(const tracer::QuadricGeometry& g, unsigned i) {
  const tracer::Quadric& q = g.quadrics[i];
  const tracer::Linear& m = q.render_from_shape;
  const auto end = [&](double z, double radius) {
    return BareBounds{q.origin + m.z * z, tracer::disc_extent(m) * radius};
  };
  const auto enclose = [](const BareBounds& a, const BareBounds& b) {
    tracer::Bounds both;
    for (const BareBounds& bounds : {a, b}) {
      both.include(bounds.center - bounds.extent);
      both.include(bounds.center + bounds.extent);
    }
    return BareBounds{(both.low + both.high) * 0.5, (both.high - both.low) * 0.5};
  };
  switch (q.kind) {
    case tracer::kind_of<tracer::UnitSphere>:
      return {q.origin, tracer::ellipsoid_extent(m)};
    case tracer::kind_of<tracer::UnitDisc>:
      return end(0, 1);
    case tracer::kind_of<tracer::Frustum>:
      return enclose(end(0, q.radius_0), end(1, q.radius_1));
    case tracer::kind_of<tracer::UnitCube>:
      break;
  }
  return {q.origin + (m.x + m.y + m.z) * 0.5, (abs(m.x) + abs(m.y) + abs(m.z)) * 0.5};
}

}  // namespace bench
