#pragma once
/// One triangle, or the two that share an edge and are one to Embree, in floats: whether a ray may meet them. Few of
/// those that Embree proposes are met, and only these pay for doubles. No answer depends on it: "no" is said only where
/// triangle_hit.h says so too, whatever both round.
///
/// For a line through o along the unit d, and a triangle a, b, c, let m = (a - o) x d. The functions of its edges (see
/// triangle_hit.h, where all are multiplied by d's largest component) are (b - a).m, (a - c).m and what is missing to
/// their sum, ((b - a) x (a - c)).d (Moeller, Trumbore 1997, "Fast, minimum storage ray-triangle intersection", JGT
/// 2(1)). Two of them that surely differ in sign mean that the line passes by.
///
/// How wrong they are, with u = 2^-24, e the longest edge, r the radius of the ball around the scene and k the distance
/// of its middle from 0; rounding errors in norms, by Cauchy-Schwarz (Higham 2002, "Accuracy and Stability of Numerical
/// Algorithms", sec. 3.1 and 3.5). Embree's ray starts within 2.7 r of the middle. Then m is wrong by u(|a| + |o| +
/// 4.9 |a - o|), the first two functions by e u(|a| + |o| + 8.9 |a - o|), the sum by 9.3 u e^2, and the third by both
/// and its own subtractions: altogether by no more than e u(4 k + 112 r), which float_error_bound() rounds up.
///
/// Doubles round as well, by 2^-53 of how far the vertices are from where the ray really starts, at most start + 5 r:
/// the functions by 2^-53 r(54 start + 345 r) after division by d's largest component, at least 1/sqrt(3). And the
/// place where Embree's ray starts is rounded in double before it is in float: 2^-53 e(2 start + 2 k + 6 r).
/// double_error_bound() is above their sum.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tracer/src/accel/triangle_pairs.h"
#include "tracer/src/math/wide.h"

namespace tracer {

struct FloatVec {
  float x, y, z;
  bool operator==(const FloatVec&) const = default;
};

WHITTLE_INLINE float dot(const FloatVec& a, const FloatVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WHITTLE_INLINE FloatVec cross(const FloatVec& a, const FloatVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// One line of the cache. Corners: the edge from a to b is that of both triangles of a pair, c and d their third ones.
struct alignas(64) TrianglePairBounds {
  FloatVec a, a_to_b, c_to_a;
  FloatVec d_to_a;  ///< of a single triangle: the product (b - a) x (a - c)
  float longest;    ///< edge that ends in a, not rounded down
  std::uint32_t geometry;
  TrianglePair triangles;
  [[nodiscard]] bool pair() const { return triangles.pair(); }
  bool operator==(const TrianglePairBounds&) const = default;
};
static_assert(sizeof(TrianglePairBounds) == 64);

/// Of triangles of the geometry that rays know as `index`. Precondition: two corners of a pair are the same, and none
/// of a triangle's is twice in it.
inline TrianglePairBounds triangle_run(const TriangleGeometry& geometry, std::uint32_t index, TrianglePair triangles) {
  auto [a, b, c] = geometry.triangles[triangles.first];
  std::uint32_t other = c;
  if (triangles.pair()) {
    const std::array<std::uint32_t, 3>& second = geometry.triangles[triangles.second];
    const auto in_second = [&](std::uint32_t corner) {
      return std::find(second.begin(), second.end(), corner) != second.end();
    };
    if (!in_second(a)) std::swap(a, c);
    if (!in_second(b)) std::swap(b, c);
    other = second[0] ^ second[1] ^ second[2] ^ a ^ b;  // what is left of the three
  }
  const Vec3& corner = geometry.position(a);
  const auto single = [](const Vec3& v) {
    return FloatVec{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  };
  const Vec3 to_b = geometry.position(b) - corner;
  const Vec3 from_c = corner - geometry.position(c), from_d = corner - geometry.position(other);
  const double longest = std::sqrt(std::max({dot(to_b, to_b), dot(from_c, from_c), dot(from_d, from_d)}));
  const FloatVec a_to_b = single(to_b), c_to_a = single(from_c);
  return {single(corner),
          a_to_b,
          c_to_a,
          triangles.pair() ? single(from_d) : cross(a_to_b, c_to_a),
          static_cast<float>(longest * (1 + 0x1p-22)),
          index,
          triangles};
}

/// What floats are wrong by, for each unit of a triangle's longest edge.
inline float float_error_bound(double middle, double radius) { return static_cast<float>((middle + radius) * 0x1p-17); }

/// What doubles are wrong by, for a ray of which Embree's starts `start` further on. From further than 2^27 boxes away
/// the float ray starts too early for what is said above, and nothing is known.
WHITTLE_INLINE float double_error_bound(double start, double middle, double radius) {
  const double away = std::abs(start);
  const double error_bound = radius * (away + middle + radius) * 0x1p-44;
  return static_cast<float>(away < 0x1p27 ? error_bound : std::numeric_limits<double>::infinity());
}

/// False where the line surely passes by. `normal` is (b - a) x (a - c), `at_c` the function of the edge across c, and
/// `doubt` what all three may be wrong by. By least and greatest, not by six comparisons: those that two triangles
/// share would become jumps and the loop no vector code.
WHITTLE_INLINE bool may_hit(float at_c, const FloatVec& c_to_a, const FloatVec& normal, const FloatVec& moment,
                            const FloatVec& direction, float error_bound) {
  const float at_b = dot(c_to_a, moment), at_a = dot(normal, direction) - at_c - at_b;
  const float least = at_c < at_b ? at_c : at_b, greatest = at_c < at_b ? at_b : at_c;
  const float low = least < at_a ? least : at_a, high = greatest < at_a ? at_a : greatest;
  return (low >= -error_bound) | (high <= error_bound);
}

/// Bits of the triangles of a run.
inline constexpr int first_triangle = 1, second_triangle = 2;

/// Which triangles of the run a ray in floats may meet. `doubt`: the ray's, and the blur of the run's longest edge.
template <bool pair>
WHITTLE_INLINE int may_hit(const TrianglePairBounds& run, const FloatVec& origin, const FloatVec& direction,
                           float error_bound) {
  const FloatVec moment = cross({run.a.x - origin.x, run.a.y - origin.y, run.a.z - origin.z}, direction);
  const float across = dot(run.a_to_b, moment);
  const FloatVec normal = pair ? cross(run.a_to_b, run.c_to_a) : run.d_to_a;
  const bool first = may_hit(across, run.c_to_a, normal, moment, direction, error_bound);
  if (!pair) return first ? first_triangle : 0;
  const bool second = may_hit(across, run.d_to_a, cross(run.a_to_b, run.d_to_a), moment, direction, error_bound);
  return (first ? first_triangle : 0) | (second ? second_triangle : 0);
}

}  // namespace tracer
