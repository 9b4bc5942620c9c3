#pragma once
/// Triangles: their intersection in double precision, and the pairs of them that are Embree primitives.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/math/lanes.h"

namespace tracer {

// Intersection of a ray and a triangle in double precision. No ray passes between triangles that share an edge or a
// vertex: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1). Branch-free.
//
// It is watertight because: (1) The projection of a vertex across the ray depends on the ray and on that vertex only,
// so triangles that share a vertex use the same, if rounded, projection. (2) The function of an edge a*b - c*d has,
// rounded, the sign of the exact one or is zero: rounding is monotonic, so a*b > c*d never becomes <, and contraction,
// which would break it, is off. From the other side the same edge gives exactly its negative. (3) Comparisons are
// closed: zero belongs to both sides. So a ray hits at least one of the triangles around an edge or a vertex. Their
// method resolves ties in higher precision to select one; here both are hits and the lowest primitive wins.

/// The dominant axis is that of the largest component of a direction; between equal ones the choice changes no hit.
WHITTLE_INLINE bool x_is_dominant(const Vec3& d) {
  return (std::abs(d.x) >= std::abs(d.y)) & (std::abs(d.x) > std::abs(d.z));
}
/// True if y is dominant. Precondition: x is not.
WHITTLE_INLINE bool y_exceeds_z(const Vec3& d) { return std::abs(d.y) > std::abs(d.z); }

/// `t` is NaN, which is nearer than nothing, if there is no hit.
struct TriangleHit {
  double t = std::numeric_limits<double>::quiet_NaN();
  double u = 0, v = 0;  ///< weights of the second and third vertex
};

struct TriangleTest {
  Vec3 a, b, c;
};

inline TriangleTest triangle_test(const TriangleGeometry& geometry, std::uint32_t primitive) {
  const auto& [a, b, c] = geometry.triangles[primitive];
  return {geometry.position(a), geometry.position(b), geometry.position(c)};
}

/// Swaps the ray's dominant axis into z: projecting along it loses no digits. The swap changes no hit, since both sides
/// of a triangle count. Instead of shearing by d.x / d.z all is multiplied by d.z: no division.
struct RayShear {
  Vec3 origin;
  double dx, dy, dz;
  bool along_x, along_y;  ///< the dominant axis; neither: z
};

WHITTLE_INLINE RayShear ray_shear(const Vec3& o, const Vec3& d, bool along_x, bool along_y) {
  return {o, along_x ? d.z : d.x, along_y ? d.z : d.y, along_x ? d.x : (along_y ? d.y : d.z), along_x, along_y};
}

WHITTLE_INLINE RayShear ray_shear(const Vec3& o, const Vec3& d) {
  const bool along_x = x_is_dominant(d);
  return ray_shear(o, d, along_x, !along_x & y_exceeds_z(d));
}

/// A vertex relative to the ray: x and y across it, z along it, each times the ray's dominant component.
struct ShearedVertex {
  double x, y, z;
};

WHITTLE_INLINE ShearedVertex sheared(const RayShear& ray, const Vec3& vertex) {
  const double x = vertex.x - ray.origin.x, y = vertex.y - ray.origin.y, z = vertex.z - ray.origin.z;
  const double across_x = ray.along_x ? z : x, across_y = ray.along_y ? z : y;
  const double along = ray.along_x ? x : (ray.along_y ? y : z);
  return {across_x * ray.dz - along * ray.dx, across_y * ray.dz - along * ray.dy, along};
}

/// Functions of the edges, each named after the vertex across the edge: its share in their sum is that vertex's weight.
struct ShearedTriangle {
  double at_a, at_b, at_c;
  double depth_a, depth_b, depth_c;
  bool inside;
};

WHITTLE_INLINE double edge(const ShearedVertex& from, const ShearedVertex& to) { return to.x * from.y - to.y * from.x; }

WHITTLE_INLINE ShearedTriangle sheared(const RayShear& ray, const TriangleTest& triangle) {
  const ShearedVertex a = sheared(ray, triangle.a), b = sheared(ray, triangle.b), c = sheared(ray, triangle.c);
  const double at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
  const bool inside = ((at_a >= 0) & (at_b >= 0) & (at_c >= 0)) | ((at_a <= 0) & (at_b <= 0) & (at_c <= 0));
  return {at_a, at_b, at_c, a.z, b.z, c.z, inside};
}

/// `dz` is the ray's dominant component.
WHITTLE_INLINE TriangleHit watertight_hit(const ShearedTriangle& s, double dz) {
  const double whole = s.at_a + s.at_b + s.at_c;  // of one sign: nothing cancels, and it is zero only edge-on
  const double share = 1 / whole;
  const double u = s.at_b * share, v = s.at_c * share;
  // A mean: never outside the triangle's depths.
  const double t = (s.at_a * share * s.depth_a + u * s.depth_b + v * s.depth_c) / dz;
  TriangleHit hit;
  hit.t = s.inside & (whole != 0) & (t > 0) & (t <= std::numeric_limits<double>::max()) ? t : hit.t;
  hit.u = u < 1 ? u : 1;
  hit.v = v < 1 - hit.u ? v : 1 - hit.u;
  return hit;
}

/// Triangles of a mesh that form one Embree primitive: two that share an edge and fill a box, as the halves of a
/// polygon and neighbors in a strip do, or a single one. On terrains of 10^5, 10^6 and 4 10^6 triangles (one AVX-512
/// core, processor time) pairs were built in 0.6, 0.56 and 0.4 and traced in 0.93, 0.87 and 0.86 of the time of single
/// triangles, and the tree took 0.6 of the bytes; groups of four were built faster still, but small scenes traced
/// slower.
struct TrianglePair {
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t first, second = none;
  [[nodiscard]] bool pair() const { return second != none; }
  bool operator==(const TrianglePair&) const = default;
};

/// Groups every triangle, in the order of their first ones. Neighbors in the list are tried first: most files have them
/// in that order, and finding them costs little. If that leaves many single, their neighbors across edges are tried, up
/// to a bounded number for each edge: linear time for any mesh. Takes 12 bytes per triangle meanwhile. Incomplete after
/// cancellation.
std::vector<TrianglePair> triangle_pairs(const TriangleGeometry& geometry,
                                         const RenderControl& control = RenderControl());

/// True if work on many elements is cancelled, which it looks for once in about a millisecond.
inline bool cancelled_at(std::size_t element, const RenderControl& control) {
  constexpr std::size_t at_once = std::size_t{1} << 16;
  return element % at_once == 0 && control.cancelled();
}

struct FloatVec {
  float x, y, z;
  bool operator==(const FloatVec&) const = default;
};

WHITTLE_INLINE float dot(const FloatVec& a, const FloatVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WHITTLE_INLINE FloatVec cross(const FloatVec& a, const FloatVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// One Embree primitive in floats: a test that rejects most rays. Few of the triangles that Embree proposes are hit,
/// and only these pay for doubles. It rejects no hit of watertight_hit(), whatever both round, so no result depends on
/// it.
///
/// For a line through o along the unit d, and a triangle a, b, c, let m = (a - o) x d. The functions of its edges (see
/// ShearedTriangle, where all are multiplied by d's dominant component) are (b - a).m, (a - c).m and the remainder to
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
    const auto in_second = [&](std::uint32_t corner) { return std::ranges::find(second, corner) != second.end(); };
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
  PrimitiveGroups(const Geometry& geometry, std::uint32_t index, const RenderControl& /*control*/)
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
  /// `index` is the number of the geometry. Incomplete after cancellation.
  PrimitiveGroups(const TriangleGeometry& geometry, std::uint32_t index, const RenderControl& control)
      : geometry_(&geometry), index_(index), pairs_(triangle_pairs(geometry, control)) {
    if (!worth_storing(pairs_.size(), geometry.triangles.size())) return;
    stored_.reserve(pairs_.size());
    for (const TrianglePair& pair : pairs_) {
      if (cancelled_at(stored_.size(), control)) return;
      stored_.push_back(triangle_pair_bounds(geometry, index, pair));
    }
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
