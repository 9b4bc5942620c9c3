// The float test of triangle pairs rejects no ray that hits in double or in exact arithmetic.

#include <gtest/gtest.h>

#include <span>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/accel/triangle_pairs.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr double center = 0.2, radius = 0.9;  // bounding sphere of the corners

struct Line {
  Vec3 origin, direction;
  double start;  ///< start of Embree's ray
};

FloatVec single(const Vec3& v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

/// Bits of the triangles that the float test does not reject.
int may_hit(const TrianglePairBounds& bounds, const Line& line) {
  const FloatVec origin = single(line.origin + line.direction * line.start), direction = single(line.direction);
  const float error_bound =
      bounds.longest * float_error_bound(center, radius) + double_error_bound(line.start, center, radius);
  return bounds.pair() ? may_hit<true>(bounds, origin, direction, error_bound)
                       : may_hit<false>(bounds, origin, direction, error_bound);
}

bool hits_in_double(const TriangleGeometry& geometry, std::uint32_t primitive, const Line& line) {
  return sheared(ray_shear(line.origin, line.direction), triangle_test(geometry, primitive)).inside;
}

/// Least edge function in long double: negative outside.
Real exactly_inside(const TriangleGeometry& geometry, std::uint32_t primitive, const Line& line) {
  const auto& [a, b, c] = geometry.triangles[primitive];
  const auto edge = [&](std::uint32_t from, std::uint32_t to) {
    const Vec p = geometry.position(from);
    return dot(geometry.position(to) - p, cross(p - Vec(line.origin), Vec(line.direction)));
  };
  const Real at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
  return std::fmax(std::fmin(at_a, std::fmin(at_b, at_c)), -std::fmax(at_a, std::fmax(at_b, at_c)));
}

double next_to(Random& random, double value) {
  for (std::uint32_t i = random.below(3); i > 0; --i) value = std::nextafter(value, random.sign() * HUGE_VAL);
  return value;
}

/// Two triangles that share an edge, anywhere in the sphere: regular ones, slivers and tiny ones; some are degenerate.
TriangleGeometry random_pair(Random& random) {
  const double size = random.chance(0.5) ? random.spread(1e-12, 1) : 1;
  const Vec a = random.vector(0.25);
  const Vec b = a + Real(size) * Vec(random.vector(0.2));
  TriangleGeometry geometry;
  geometry.positions = {rounded(a), rounded(b)};
  for (int side = 0; side < 2; ++side) {
    const Vec along = a + Real(random.in(-0.2, 1.2)) * (b - a);
    const Real height = random.chance(0.5) ? random.spread(1e-14, 1e-1) : 0.3;
    geometry.positions.push_back(rounded(along + Real(size) * height * random.direction()));
  }
  std::array<std::uint32_t, 3> first{0, 1, 2}, second{1, 0, 3};
  std::rotate(first.begin(), first.begin() + random.below(3), first.end());
  std::rotate(second.begin(), second.begin() + random.below(3), second.end());
  geometry.triangles = {first, second};
  return geometry;
}

/// A line within a few bits of a corner or an edge, or at a distance of any fraction of the triangle's size, or far
/// from a tiny triangle; from near and far origins.
Line random_line(Random& random, const TriangleGeometry& geometry, double far) {
  const auto& corners = geometry.triangles[random.below(2)];
  const Vec p = geometry.position(corners[0]), q = geometry.position(corners[1]), r = geometry.position(corners[2]);
  const Real along = random.chance(0.3) ? 0 : random.in(0, 1);
  Vec target = p + along * (q - p);
  if (random.chance(0.7)) target = target + Real(random.sign() * std::exp2(random.in(-56, 0))) * (r - p);
  if (random.chance(0.2)) target = target + Real(random.spread(1e-6, 0.2)) * random.direction();
  Vec direction = random.direction();
  if (random.chance(0.3))  // almost in the plane
    direction = unit(q - p + Real(random.in(-1, 1)) * (r - p) + Real(std::exp2(random.in(-60, -2))) * direction);
  if (!(length(direction) > 0.5L)) direction = random.direction();
  const double back = random.spread(1e-6, far);
  const Vec3 origin = rounded(target - Real(back) * direction);
  Vec3 aimed = rounded(unit(target - Vec(origin)));
  aimed = {next_to(random, aimed.x), next_to(random, aimed.y), next_to(random, aimed.z)};
  return {origin, aimed, back > 2 ? back - random.in(0, 1.5) : -0x1p-20};
}

TEST(TrianglePairBounds, RejectNoRayThatHitsInDoubleOrExactly) {
  Random random(21);
  std::uint64_t tried = 0, rejected = 0, hits = 0;
  for (std::uint64_t i = 0; i < effort::cases(60'000); ++i) {
    const TriangleGeometry geometry = random_pair(random);
    const bool degenerate = !(length(geometry.positions[1] - geometry.positions[0]) > 0);
    const TrianglePairBounds both = triangle_pair_bounds(geometry, 0, {0, degenerate ? TrianglePair::none : 1});
    const TrianglePairBounds single_bounds[] = {triangle_pair_bounds(geometry, 0, {0}),
                                                triangle_pair_bounds(geometry, 0, {1})};
    for (int k = 0; k < 30; ++k) {
      const Line line = random_line(random, geometry, random.chance(0.2) ? 0x1p26 : 3);
      for (std::uint32_t side = 0; side < 2; ++side) {
        const bool inside = hits_in_double(geometry, side, line);
        const bool by_pair = both.pair() && (may_hit(both, line) & (1 << side)) == 0;
        const bool by_itself = may_hit(single_bounds[side], line) == 0;
        ++tried;
        hits += inside ? 1 : 0;
        if (!by_pair && !by_itself) continue;
        ++rejected;
        ASSERT_FALSE(inside) << "triangle " << side << (by_pair ? " of the pair" : " single") << ", from " << line.start
                             << " away";
        ASSERT_LT(exactly_inside(geometry, side, line), 0);
      }
    }
  }
  EXPECT_GT(rejected, tried / 10) << "the test must reject misses";
  EXPECT_GT(hits, tried / 10);
}

TEST(TrianglePairBounds, RejectRaysThatMissByAHundredthOfTheSize) {
  Random random(22);
  for (std::uint64_t i = 0; i < effort::cases(20'000); ++i) {
    const double size = random.spread(0x1p-8, 0.4), back = random.spread(0.1, 0x1p16);
    const Vec3 at = random.vector(0.2);
    TriangleGeometry geometry;
    geometry.positions = {at, at + Vec3{size, 0, 0}, at + Vec3{0, size, 0}, at + Vec3{size, size, 0}};
    geometry.triangles = {{0, 1, 2}, {1, 2, 3}};
    const double along = random.in(0.1, 0.9) * size, out = 0.01 * size;
    const Vec3 target = at + (random.chance(0.5) ? Vec3{along, -out, 0} : Vec3{-out, along, 0});
    const Vec3 direction = normalize(random.vector(0.5) + Vec3{0, 0, 1});
    const Line line{target - direction * back, direction, back > 1 ? back - 1 : 0};
    ASSERT_EQ(may_hit(triangle_pair_bounds(geometry, 0, {0, 1}), line), 0) << "size " << size << " from " << back;
    ASSERT_EQ(may_hit(triangle_pair_bounds(geometry, 0, {0}), line), 0);
    const Vec3 inside = at + Vec3{0.3 * size, 0.3 * size, 0};
    ASSERT_EQ(may_hit(triangle_pair_bounds(geometry, 0, {0, 1}), {inside - direction * back, direction, line.start}),
              first_triangle);
  }
}

TEST(TrianglePairBounds, RejectNoRayFromBeyondTheRangeOfTheErrorBound) {
  TriangleGeometry geometry;
  geometry.positions = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  geometry.triangles = {{0, 1, 2}};
  const TrianglePairBounds bounds = triangle_pair_bounds(geometry, 0, {0});
  EXPECT_EQ(may_hit(bounds, {{-0.4, 0, -0x1p26}, {0, 0, 1}, 0x1p26}), 0);
  EXPECT_EQ(may_hit(bounds, {{-0.4, 0, -0x1p27}, {0, 0, 1}, 0x1p27}), first_triangle);
  EXPECT_EQ(may_hit(bounds, {{-0.4, 0, -0x1p99}, {0, 0, 1}, 0x1p99}), first_triangle);
}

/// `count` triangles, of which consecutive pairs or none share an edge.
TriangleGeometry many(std::uint32_t count, bool pairs) {
  constexpr Vec3 corners[] = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0.5, 0.5, 0}};
  TriangleGeometry geometry;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto next = static_cast<std::uint32_t>(geometry.positions.size());
    const bool second = pairs && i % 2 != 0;
    for (const Vec3& corner : second ? std::span(corners).last(1) : std::span(corners).first(3))
      geometry.positions.push_back(corner);
    geometry.triangles.push_back(second ? std::array{next - 2, next - 1, next} : std::array{next, next + 1, next + 2});
  }
  return geometry;
}

TEST(TrianglePairBounds, AreStoredUnlessTheyTakeTooMuchMemory) {
  constexpr std::uint32_t large = (1u << 20) + 2;
  const auto bytes_each = [](std::uint32_t count, bool pairs) {
    const TriangleGeometry geometry = many(count, pairs);
    const PrimitiveGroups<TriangleGeometry> groups(geometry, 7, {});
    const std::vector<TrianglePair> triangles = triangle_pairs(geometry);
    TrianglePairBounds storage;
    for (std::uint32_t group = 0; group < groups.count(); group += groups.count() / 100) {
      const TrianglePairBounds expected = triangle_pair_bounds(geometry, 7, triangles[group]);
      EXPECT_TRUE(groups.at(group, storage) == expected);
    }
    return static_cast<double>(groups.memory_bytes()) / count;
  };
  EXPECT_NEAR(bytes_each(large, true), 32 + 4, 0.1);
  EXPECT_NEAR(bytes_each(large, false), 8, 0.1) << "not stored";
  EXPECT_NEAR(bytes_each(1000, false), 64 + 8, 0.1);
}

}  // namespace
}  // namespace tracer
