#pragma once
/// All crossings of a line with the parts of a quadric, in long double: the expected hits of the accelerator.

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/long_vec.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {

using oracle::Real;
using oracle::Vec;

inline constexpr Real infinity = std::numeric_limits<Real>::infinity();

/// The map from the shape's space to render space in long double, and its inverse by Cramer's rule.
struct Map {
  Vec x, y, z, offset;
  std::array<Vec, 3> inverse;  ///< rows

  explicit Map(const Quadric& q)
      : x(q.render_from_shape.x), y(q.render_from_shape.y), z(q.render_from_shape.z), offset(q.origin) {
    const Real scale = 1 / dot(x, cross(y, z));
    inverse = {scale * cross(y, z), scale * cross(z, x), scale * cross(x, y)};
  }

  [[nodiscard]] Vec point(const Vec& p) const { return offset + p.x * x + p.y * y + p.z * z; }
  [[nodiscard]] Vec shape_point(const Vec& p) const { return shape_direction(p - offset); }
  [[nodiscard]] Vec shape_direction(const Vec& d) const {
    return {dot(inverse[0], d), dot(inverse[1], d), dot(inverse[2], d)};
  }
  /// The image of a gradient in the shape's space.
  [[nodiscard]] Vec gradient(const Vec& g) const { return g.x * inverse[0] + g.y * inverse[1] + g.z * inverse[2]; }
  /// Upper bound of the length of a shape-space vector over that of its image.
  [[nodiscard]] Real growth() const {
    return std::sqrt(dot(inverse[0], inverse[0]) + dot(inverse[1], inverse[1]) + dot(inverse[2], inverse[2]));
  }
};

/// A crossing of the line with the shape's surface; its margin, the distance by which the line would have to move for
/// the number of crossings to change, in the shape's units; and the sine of the angle to the surface, which scales t's
/// error.
struct Crossing {
  Real t = 0, margin = 0, steepness = 1;
  QuadricPart part{};
};

struct Line {
  Vec o, d;  // shape's space
  [[nodiscard]] Vec at(Real t) const { return o + t * d; }
};

struct Crossings {
  std::vector<Crossing> all;
  Real margin = infinity;  ///< margin of the nearest miss

  void offer(Real t, Real inside, Real steepness, QuadricPart part) {
    if (!std::isfinite(t) || std::isnan(inside)) return;
    if (inside >= 0) {
      all.push_back({t, inside, steepness, part});
    } else {
      margin = std::fmin(margin, -inside);
    }
  }
};

inline void disc_crossings(const Line& line, Real z, Real inner, Real outer, QuadricPart part, Crossings& found) {
  if (line.d.z == 0) return;
  const Real t = (z - line.o.z) / line.d.z;
  const Vec p = line.at(t);
  const Real r = std::hypot(p.x, p.y);
  // The angle to the plane scales the margin: the hit of a grazing ray has a larger error in the plane.
  const Real inside = std::fmin(outer - r, inner > 0 ? r - inner : infinity);
  const Real steepness = std::fabs(line.d.z) / length(line.d);
  found.offer(t, inside * steepness, steepness, part);
}

/// A quadratic with the given coefficients; nothing where the discriminant is negative.
inline std::vector<Real> roots(Real a, Real b, Real c) {  // a t^2 - 2 b t + c
  const Real discriminant = b * b - a * c;
  if (a == 0) return b != 0 ? std::vector<Real>{c / (2 * b)} : std::vector<Real>{};
  if (discriminant < 0) return {};
  const Real root = std::sqrt(discriminant);
  const Real q = b >= 0 ? b + root : b - root;
  if (q == 0) return {0};
  return {q / a, c / q};
}

/// Signed distance from a torus around the unit circle.
inline Real torus_distance(const Vec& p, Real tube_radius) {
  return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - tube_radius;
}

/// Sphere tracing (Hart 1996, The Visual Computer 12(10)): the distance has slope one at most, so no step passes a
/// crossing. Chords shorter than `chord` count as tangents.
inline void torus_crossings(const Line& line, Real tube_radius, Crossings& found) {
  constexpr Real chord = 1e-9L, reach = 2.1L;
  constexpr int steps_max = 20'000;
  const Real speed = length(line.d), shift = -dot(line.o, line.d) / dot(line.d, line.d);
  const Line unit_line{line.at(shift), (1 / speed) * line.d};
  const auto distance = [&](Real s) { return torus_distance(unit_line.at(s), tube_radius); };
  Real s = -reach;
  for (int step = 0; s < reach; ++step) {
    const Real here = distance(s);
    if (step == steps_max) found.margin = 0;  // along the surface
    if (step == steps_max) return;
    if (std::fabs(here) > chord / 4) {
      const Real next = s + 0.9L * std::fabs(here);
      // A minimum that is no crossing: the distance grows again.
      if (std::fabs(distance(next)) > std::fabs(here)) found.margin = std::fmin(found.margin, std::fabs(here) / 4);
      s = next;
      continue;
    }
    Real low = s - chord, high = s + chord;
    const bool outside = distance(low) > 0;
    if ((distance(high) > 0) == outside) found.margin = 0;
    for (int i = 0; i < 80 && (distance(high) > 0) != outside; ++i) {
      const Real middle = (low + high) / 2;
      ((distance(middle) > 0) == outside ? low : high) = middle;
    }
    const Vec p = unit_line.at(low);
    const Real r = std::hypot(p.x, p.y), across = r - 1;
    const Vec normal = unit(Vec(across * p.x / r, across * p.y / r, p.z));
    const Real steepness = std::fabs(dot(normal, unit_line.d));
    // Depth of the chord at this angle where the surface is curved most.
    found.all.push_back({shift + low / speed, steepness * steepness * tube_radius / 4, steepness, QuadricPart::side});
    s = high + chord;
  }
}

inline Crossings crossings_of(const Quadric& q, const Line& line) {
  Crossings found;
  const Vec &o = line.o, &d = line.d;
  const Real speed = length(d);
  // From the point nearest to the shape's middle, so that distance costs no digits here either.
  const Vec middle = q.kind == kind_of<UnitSphere> ? Vec{} : Vec(0, 0, 0.5L);
  const Real shift = -dot(o - middle, d) / dot(d, d);
  const Vec n = o + shift * d;
  switch (q.kind) {
    case kind_of<UnitSphere>: {
      const Real miss = length(n);
      if (miss > 1) {
        found.margin = miss - 1;
        break;
      }
      const Real half = std::sqrt((1 - miss) * (1 + miss)) / speed;
      for (const Real t : {shift - half, shift + half})
        found.all.push_back({t, 1 - miss, half * speed, QuadricPart::side});
      break;
    }
    case kind_of<UnitTorus>:
      torus_crossings(line, q.radius_0, found);
      break;
    case kind_of<UnitDisc>:
      disc_crossings(line, 0, q.radius_0, 1, QuadricPart::cap_1, found);
      break;
    case kind_of<Frustum>: {
      const Real slope = Real(q.radius_1) - q.radius_0, w = q.radius_0 + slope * n.z, dw = slope * d.z;
      const Real a = d.x * d.x + d.y * d.y - dw * dw, b = -(n.x * d.x + n.y * d.y - w * dw);
      const Real c = n.x * n.x + n.y * n.y - w * w;
      // Distance of the line from a tangent.
      const Real turn = n.x * d.y - n.y * d.x, ox = n.x * dw - w * d.x, oy = n.y * dw - w * d.y;
      const Real tangency = std::fabs(ox * ox + oy * oy - turn * turn) / dot(d, d);
      found.margin = std::fmin(found.margin, tangency);
      for (const Real t : roots(a, b, c)) {
        const Real z = n.z + t * d.z;
        // Steep against the side, an error along the normal moves z far.
        const Vec p = n + t * d;
        const Real r = std::hypot(p.x, p.y);
        const Vec normal = r > 0 ? unit(Vec(p.x / r, p.y / r, -slope)) : Vec{};
        const Real steepness = std::fabs(dot(normal, d)) / speed;
        // Towards the apex the equation flattens with r, and its roots lose digits.
        found.offer(t + shift, std::fmin(z, 1 - z) * steepness, steepness * std::fmin(r, 1.0L), QuadricPart::side);
      }
      if (q.caps && q.radius_0 > 0) disc_crossings({n, d}, 0, 0, q.radius_0, QuadricPart::cap_0, found);
      if (q.caps && q.radius_1 > 0) disc_crossings({n, d}, 1, 0, q.radius_1, QuadricPart::cap_1, found);
      for (Crossing& crossing : found.all)
        if (crossing.part != QuadricPart::side) crossing.t += shift;
      break;
    }
    case kind_of<UnitCube>: {
      const std::array<Real, 3> on{n.x, n.y, n.z}, dd{d.x, d.y, d.z};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, 1}) {
          if (dd[axis] == 0) continue;
          const Real t = (side - on[axis]) / dd[axis];
          Real inside = infinity;
          for (std::size_t other = 0; other < 3; ++other) {
            const Real p = on[other] + t * dd[other];
            if (other != axis) inside = std::fmin(inside, std::fmin(p, 1 - p));
          }
          const Real steepness = std::fabs(dd[axis]) / speed;
          found.offer(t + shift, inside * steepness, steepness,
                      static_cast<QuadricPart>(static_cast<int>(QuadricPart::x_0) + 2 * static_cast<int>(axis) + side));
        }
      break;
    }
  }
  return found;
}

}  // namespace tracer
