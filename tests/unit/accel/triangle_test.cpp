// Hits of triangles, against Cramer's rule in long double.
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/expected_hits.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// The edge functions of watertight_hit() in long double, with bounds of their errors in double (r: unit roundoff). A
/// vertex at the distance V is sheared by a subtraction, two products and a subtraction in each of two coordinates: its
/// error is at most sqrt(2) * 3 r V. A function of two vertices adds the errors of its products and of its subtraction,
/// at most 2 r times the lengths of both (Cauchy-Schwarz). Only the parts across the ray count: small beside V, so they
/// are taken first.
ExpectedHit expected_for(const TriangleGeometry& geometry, const TestRay& ray, std::uint32_t triangle) {
  constexpr Real roundoff = 0x1p-53L;
  const Vec d = ray.direction;
  const Real dominant = std::fmax(std::fabs(d.x), std::fmax(std::fabs(d.y), std::fabs(d.z)));
  std::array<Vec, 3> corner, beside;
  std::array<Real, 3> across, error, at;
  for (int k = 0; k < 3; ++k) {
    corner[k] = Vec(geometry.position(geometry.triangles[triangle][k])) - Vec(ray.origin);
    beside[k] = corner[k] - (dot(corner[k], d) / dot(d, d)) * d;
    across[k] = length(beside[k]);
    error[k] = 5 * roundoff * length(corner[k]);
  }
  Real whole = 0, errors = 0, farthest = 0, longest = 0;
  bool certain = true, positive = false, negative = false;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    at[k] = dominant * dot(d, cross(beside[i], beside[j]));
    const Real bound = (across[i] + error[i]) * (across[j] + error[j]) * (1 + 2 * roundoff) - across[i] * across[j];
    positive |= at[k] > bound;
    negative |= at[k] < -bound;
    certain &= std::fabs(at[k]) > bound;
    whole += at[k];
    errors += bound;
    farthest = std::fmax(farthest, length(corner[k]));
    longest = std::fmax(longest, length(corner[j] - corner[i]));
  }
  if (positive && negative) return {false};
  if (!certain) return {};
  // A weight is a function over the sum of all, and t a mean of depths that differ by the longest edge at most.
  const Real weights = 2 * errors / (std::fabs(whole) - errors) + 4 * roundoff;
  const Vec hit = (at[0] / whole) * corner[0] + (at[1] / whole) * corner[1] + (at[2] / whole) * corner[2];
  const Real t = dot(hit, d) / dot(d, d), t_error = (weights * longest + 10 * roundoff * farthest) / dominant;
  if (std::fabs(t) <= t_error || std::fabs(t - ray.t_max) <= t_error) return {};
  return {t > 0 && t < ray.t_max, t, t_error, at[1] / whole, weights, at[2] / whole, weights};
}

/// Three points in the box: regular triangles to needles, large to small.
std::array<Vec, 3> random_corners(Random& random) {
  const Real size = random.chance(0.3) ? random.spread(1e-8, 1) : 1;
  const Vec a = random.vector(0.5);
  const Vec b = a + size * Vec(random.vector(0.5));
  if (random.chance(0.1)) return {a, b, b + size * Real(random.spread(1e-6, 1e-3)) * random.direction()};
  if (random.chance(0.4)) {  // its third corner beside the edge, or beyond an end
    const Vec along = a + random.in(-0.2, 1.2) * (b - a);
    return {a, b, along + size * random.spread(1e-7, 1e-1) * random.across(unit(b - a))};
  }
  return {a, b, a + size * Vec(random.vector(0.5))};
}

/// A ray at the inside, the outside, an edge or a corner; from near or far, from all sides or grazing.
TestRay random_ray(Random& random, const std::array<Vec, 3>& corners) {
  Real u = random.in(0, 1), v = random.in(0, 1);
  const std::uint32_t kind = random.below(5);
  if (kind < 2 && u + v > 1) u = 1 - u, v = 1 - v;
  if (kind == 2) u = 3 * u - 1, v = 3 * v - 1;
  if (kind == 3) v = random.chance(0.5) ? 0 : 1 - u;
  if (kind == 4) u = random.below(2), v = u > 0 ? 0 : random.below(2);
  const Vec target = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2];
  Vec direction = random.direction();
  if (random.chance(0.2)) {
    const Vec n = unit(cross(corners[1] - corners[0], corners[2] - corners[0]));
    direction = unit(random.across(n) + Real(random.sign() * random.spread(1e-9, 1e-1)) * n);
  }
  const Vec3 origin = rounded(target - Real(random.spread(0.01, random.chance(0.2) ? 1e6 : 2)) * direction);
  TestRay ray{origin, rounded(unit(target - Vec(origin)))};
  if (random.chance(0.1)) ray.t_max = static_cast<double>(length(target - Vec(origin))) * random.in(0.5, 1.5);
  return ray;
}

/// Compares the hits on `count` random triangles, in half of the scenes with others that are never the nearest.
void expect_nearest(Random& random, std::uint32_t count, int ray_count, HitCounts& counts) {
  GeometrySet set;
  TriangleGeometry& geometry = set.triangles.emplace_back();
  std::vector<std::array<Vec, 3>> corners;
  std::vector<Target> targets;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const Vec& corner : corners.emplace_back(random_corners(random)))
      geometry.positions.push_back(rounded(corner));
    geometry.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    targets.push_back({{0, i}});
  }
  geometry.positions.push_back(geometry.positions[0]);
  // Three without an area, and a double.
  if (random.chance(0.5))
    geometry.triangles.insert(geometry.triangles.end(), {{0, 1, 3 * count}, {0, 1, 0}, {2, 2, 2}, {0, 1, 2}});
  std::vector<TestRay> rays;
  for (int i = 0; i < ray_count; ++i) rays.push_back(random_ray(random, corners[random.below(count)]));
  const auto expected = [&](std::size_t i, const TestRay& ray) {
    return expected_for(geometry, ray, static_cast<std::uint32_t>(i));
  };
  expect_nearest(set, targets, rays, expected, counts);
}

TEST(TriangleHits, MatchCramersRuleForRandomRays) {
  Random random(1);
  HitCounts counts;
  for (std::uint64_t scene = 0; scene < effort::cases(2800) && !HasFailure(); ++scene)
    expect_nearest(random, 1, 401, counts);
  EXPECT_GT(counts.certain, counts.tried / 2) << "most cases must be certain";
  EXPECT_GT(counts.hits, counts.certain / 4);
  EXPECT_LT(counts.hits, counts.certain * 3 / 4);
}

TEST(TriangleHits, AreOnTheNearestOfManyNeedlesAndSlivers) {
  Random random(2);
  HitCounts counts;
  for (std::uint64_t scene = 0; scene < effort::cases(250) && !HasFailure(); ++scene)
    expect_nearest(random, 30, 121, counts);
  EXPECT_GT(counts.certain, counts.tried / 3) << "two fifths of the rays aim at edges and corners";
  EXPECT_GT(counts.hits, counts.certain / 4);
}

TEST(TriangleHits, ExcludeTheTriangleWhereTheRayStartsAndTheEdgeOfItsNeighbor) {
  // The ridge of a roof: rays from one side next to the ridge, over the other side. None hits it.
  Random random(4);
  TriangleGeometry roof;
  roof.positions = {{0, 0, 0}, {0, 0, 0.4}, {0.3, -0.1, 0.2}, {-0.3, -0.1, 0.2}};
  roof.triangles = {{0, 1, 2}, {1, 0, 3}};
  GeometrySet set;
  set.triangles.push_back(roof);
  const auto accelerator = built(set);
  std::vector<TestRay> rays;
  const Vec n = unit(Vec(0.1L, 0.3L, 0));  // of the side x > 0, upwards
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const Real down = random.spread(1e-12, 1e-6);
    const Vec start = Vec{0.3L * down, -0.1L * down, random.in(0.01, 0.39)};
    Vec direction = random.direction();
    if (dot(direction, n) < 0) direction = -direction;
    if (direction.y < 0.4L * std::fabs(direction.x)) continue;  // into the other side's half space: not over the ridge
    rays.push_back({rounded(start + 1e-16L * n), rounded(direction), HUGE_VAL, {0, 0}});
  }
  const auto hits = RayBatch(rays).intersect(*accelerator, Coherence::incoherent);
  const auto blocked = RayBatch(rays).occluded(*accelerator, Coherence::coherent);
  std::uint64_t wrong = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) wrong += hits[i].primitive.hit() || blocked[i] ? 1 : 0;
  EXPECT_EQ(wrong, 0u) << "of " << rays.size();
}

TEST(TriangleHits, AreFoundNextToADegenerateTriangle) {
  // The degenerate triangle shares two corners with the other one, but no edge.
  TriangleGeometry geometry;
  geometry.positions = {{0, 0, 0}, {0.4, 0, 0}, {0, 0.4, 0}, {0.3, 0.3, 0}, {-0.1, -0.1, 0}};
  for (const std::array<std::uint32_t, 3>& twice : {std::array{4u, 4u, 3u}, std::array{3u, 4u, 4u}})
    for (const bool first : {true, false}) {
      const std::array<std::uint32_t, 3> whole{4, 2, 1};
      geometry.triangles = first ? std::vector{twice, whole} : std::vector{whole, twice};
      GeometrySet set;
      set.triangles.push_back(geometry);
      const RayBatch batch({TestRay{{0.1, 0.1, 1}, {0, 0, -1}}});
      ASSERT_EQ(batch.intersect(*built(set), Coherence::coherent)[0].primitive, (PrimitiveRef{0, first ? 1u : 0u}));
      ASSERT_TRUE(batch.occluded(*built(set), Coherence::coherent)[0]);
    }
}

}  // namespace
}  // namespace tracer
