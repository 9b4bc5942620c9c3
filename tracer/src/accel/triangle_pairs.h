#pragma once
/// Triangles of a mesh that form one Embree primitive: two that share an edge and fill a box, as the halves of a
/// polygon and neighbors in a strip do, or a single one. On terrains of 10^5, 10^6 and 4 10^6 triangles (one AVX-512
/// core, processor time) pairs were built in 0.6, 0.56 and 0.4 and traced in 0.93, 0.87 and 0.86 of the time of single
/// triangles, and the tree took 0.6 of the bytes; groups of four were built faster still, but small scenes traced
/// slower.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/wide.h"

namespace tracer {

struct TrianglePair {
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t first, second = none;
  [[nodiscard]] bool pair() const { return second != none; }
  bool operator==(const TrianglePair&) const = default;
};

/// Groups every triangle, in the order of their first ones. Neighbors in the list are tried first: most files have them
/// in that order, and finding them costs little. If that leaves many single, their neighbors across edges are tried, up
/// to a bounded number for each edge: linear time for any mesh. Takes 12 bytes per triangle meanwhile.
std::vector<TrianglePair> triangle_pairs(const TriangleGeometry& geometry);

struct FloatVec {
  float x, y, z;
  bool operator==(const FloatVec&) const = default;
};

WHITTLE_INLINE float dot(const FloatVec& a, const FloatVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WHITTLE_INLINE FloatVec cross(const FloatVec& a, const FloatVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// One Embree primitive in floats: a test that rejects most rays. Few of the triangles that Embree proposes are hit,
/// and only these pay for doubles. It rejects no hit of triangle_hit.h, whatever both round, so no result depends on
/// it.
///
/// For a line through o along the unit d, and a triangle a, b, c, let m = (a - o) x d. The functions of its edges (see
/// triangle_hit.h, where all are multiplied by d's dominant component) are (b - a).m, (a - c).m and the remainder to
/// their sum, ((b - a) x (a - c)).d (Moeller, Trumbore 1997, "Fast, minimum storage ray-triangle intersection", JGT
/// 2(1)). If two of them certainly differ in sign, the line misses.
///
/// Error bounds, with u = 2^-24, e the longest edge, r the radius of the scene's bounding sphere and k the distance of
/// its center from 0; rounding errors in norms, by Cauchy-Schwarz (Higham 2002, "Accuracy and Stability of Numerical
/// Algorithms", sec. 3.1 and 3.5). Embree's ray starts within 2.7 r of the center. Then the error of m is u(|a| + |o| +
/// 4.9 |a - o|), of the first two functions e u(|a| + |o| + 8.9 |a - o|), of the sum 9.3 u e^2, and of the third both
/// plus its own subtractions: altogether at most e u(4 k + 112 r), which float_error_bound() rounds up.
///
/// Doubles round as well, by 2^-53 of the distance of the vertices from the ray's origin, at most start + 5 r: the
/// functions by 2^-53 r(54 start + 345 r) after division by d's dominant component, at least 1/sqrt(3). And the start
/// of Embree's ray is rounded in double before it is in float: 2^-53 e(2 start + 2 k + 6 r). double_error_bound() is
/// above their sum.
///
/// One cache line. Both triangles of a pair share the edge from a to b; c and d are their third corners.
struct alignas(64) TrianglePairBounds {
  FloatVec a, a_to_b, c_to_a;
  FloatVec d_to_a;  ///< for a single triangle: the product (b - a) x (a - c)
  float longest;    ///< edge that ends in a, not rounded down
  std::uint32_t geometry;
  TrianglePair triangles;
  [[nodiscard]] bool pair() const { return triangles.pair(); }
  bool operator==(const TrianglePairBounds&) const = default;
};
static_assert(sizeof(TrianglePairBounds) == 64);

/// `index` is the number of the geometry. Precondition: the triangles of a pair share two corners, and the corners of a
/// triangle are distinct.
inline TrianglePairBounds triangle_pair_bounds(const TriangleGeometry& geometry, std::uint32_t index,
                                               TrianglePair triangles) {
  auto [a, b, c] = geometry.triangles[triangles.first];
  std::uint32_t other = c;
  if (triangles.pair()) {
    const std::array<std::uint32_t, 3>& second = geometry.triangles[triangles.second];
    const auto in_second = [&](std::uint32_t corner) {
      return std::find(second.begin(), second.end(), corner) != second.end();
    };
    if (!in_second(a)) std::swap(a, c);
    if (!in_second(b)) std::swap(b, c);
    other = second[0] ^ second[1] ^ second[2] ^ a ^ b;  // the remaining one of the three
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

/// Float rounding error bound per unit of the longest edge. `center` is the distance of the scene's center from 0.
inline float float_error_bound(double center, double radius) { return static_cast<float>((center + radius) * 0x1p-17); }

/// Double rounding error bound for a ray whose Embree ray starts at the distance `start`. Beyond 2^27 boxes the float
/// ray starts too early for the derivation above, and the bound is infinite.
WHITTLE_INLINE float double_error_bound(double start, double center, double radius) {
  const double away = std::abs(start);
  const double error_bound = radius * (away + center + radius) * 0x1p-44;
  return static_cast<float>(away < 0x1p27 ? error_bound : std::numeric_limits<double>::infinity());
}

/// False if the line certainly misses. `normal` is (b - a) x (a - c), `at_c` the function of the edge across c, and
/// `error_bound` that of all three. By least and greatest instead of six comparisons: those that two triangles share
/// would become jumps and prevent vectorization.
WHITTLE_INLINE bool may_hit(float at_c, const FloatVec& c_to_a, const FloatVec& normal, const FloatVec& moment,
                            const FloatVec& direction, float error_bound) {
  const float at_b = dot(c_to_a, moment), at_a = dot(normal, direction) - at_c - at_b;
  const float least = at_c < at_b ? at_c : at_b, greatest = at_c < at_b ? at_b : at_c;
  const float low = least < at_a ? least : at_a, high = greatest < at_a ? at_a : greatest;
  return (low >= -error_bound) | (high <= error_bound);
}

/// Bits of the triangles of a pair.
inline constexpr int first_triangle = 1, second_triangle = 2;

/// Triangles that a float ray may hit. `error_bound` is the sum of the double and the float bound.
template <bool pair>
WHITTLE_INLINE int may_hit(const TrianglePairBounds& bounds, const FloatVec& origin, const FloatVec& direction,
                           float error_bound) {
  const FloatVec moment = cross({bounds.a.x - origin.x, bounds.a.y - origin.y, bounds.a.z - origin.z}, direction);
  const float across = dot(bounds.a_to_b, moment);
  const FloatVec normal = pair ? cross(bounds.a_to_b, bounds.c_to_a) : bounds.d_to_a;
  const bool first = may_hit(across, bounds.c_to_a, normal, moment, direction, error_bound);
  if (!pair) return first ? first_triangle : 0;
  const bool second =
      may_hit(across, bounds.d_to_a, cross(bounds.a_to_b, bounds.d_to_a), moment, direction, error_bound);
  return (first ? first_triangle : 0) | (second ? second_triangle : 0);
}

/// Embree primitives of a geometry: single ones. A triangle mesh has pairs instead. Hits are computed in double for
/// each primitive, so no result depends on the groups.
template <class Geometry>
class PrimitiveGroups {
 public:
  PrimitiveGroups(const Geometry& geometry, std::uint32_t index)
      : index_(index), count_(static_cast<std::uint32_t>(geometry.object.size())) {}
  [[nodiscard]] std::uint32_t count() const { return count_; }
  template <class Visit>
  static void for_each(std::uint32_t group, const Visit& visit) {
    visit(group);
  }
  /// The argument of intersect() and occluded().
  [[nodiscard]] PrimitiveRef at(std::uint32_t group, TrianglePairBounds& /*storage*/) const { return {index_, group}; }
  [[nodiscard]] static std::uint64_t memory_bytes() { return 0; }

 private:
  std::uint32_t index_, count_;
};

template <>
class PrimitiveGroups<TriangleGeometry> {
 public:
  /// `index` is the number of the geometry.
  PrimitiveGroups(const TriangleGeometry& geometry, std::uint32_t index)
      : geometry_(&geometry), index_(index), pairs_(triangle_pairs(geometry)) {
    if (!worth_storing(pairs_.size(), geometry.triangles.size())) return;
    stored_.reserve(pairs_.size());
    for (const TrianglePair& pair : pairs_) stored_.push_back(triangle_pair_bounds(geometry, index, pair));
  }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(pairs_.size()); }
  template <class Visit>
  void for_each(std::uint32_t group, const Visit& visit) const {
    visit(pairs_[group].first);
    if (pairs_[group].pair()) visit(pairs_[group].second);
  }
  /// The stored bounds, or else those computed into `storage`.
  [[nodiscard]] const TrianglePairBounds& at(std::uint32_t group, TrianglePairBounds& storage) const {
    return stored_.empty() ? storage = triangle_pair_bounds(*geometry_, index_, pairs_[group]) : stored_[group];
  }
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return pairs_.capacity() * sizeof(TrianglePair) + stored_.capacity() * sizeof(TrianglePairBounds);
  }

 private:
  /// Bounds take 32 bytes per triangle if all are in pairs, 64 if none is; a tree and its geometry 65 and 85. So large
  /// meshes with few pairs compute them for each packet that Embree proposes.
  static bool worth_storing(std::size_t pairs, std::size_t triangles) {
    constexpr std::size_t small = 1u << 20;
    return triangles <= small || pairs <= triangles / 4 * 3;
  }

  const TriangleGeometry* geometry_;
  std::uint32_t index_;
  std::vector<TrianglePair> pairs_;
  std::vector<TrianglePairBounds> stored_;  ///< empty if not worth storing
};

}  // namespace tracer
