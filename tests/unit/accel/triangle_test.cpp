// Hits of triangles, against Cramer's rule in long double.
#include <algorithm>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

TriangleGeometry triangle_of(const std::array<Vec, 3>& corners) {
  TriangleGeometry geometry;
  for (const Vec& corner : corners) geometry.positions.push_back(rounded(corner));
  geometry.triangles.push_back({0, 1, 2});
  return geometry;
}

struct Expected {
  Real t, u, v;
  Real inside;    ///< distance of the hit from the nearest edge, in the plane; negative outside
  Real sine;      ///< sine of the angle between ray and plane
  Real slimness;  ///< longest edge over the least height: factor from errors in the plane to errors of the weights
};

Expected expected_for(const TriangleGeometry& geometry, const TestRay& ray) {
  const Vec a = geometry.position(0), e1 = Vec(geometry.position(1)) - a, e2 = Vec(geometry.position(2)) - a;
  const Vec d = ray.direction, s = Vec(ray.origin) - a, n = cross(e1, e2);
  const Real volume = -dot(d, n);
  const Real u = dot(cross(d, e2), s) / volume, v = dot(cross(s, e1), d) / volume;
  const Real t = dot(s, n) / volume;
  // Distances to the three edges' lines, within the plane.
  const Real area = length(n);
  const Real inside =
      std::fmin(u * area / length(e2), std::fmin(v * area / length(e1), (1 - u - v) * area / length(e2 - e1)));
  const Real longest = std::fmax(length(e1), std::fmax(length(e2), length(e2 - e1)));
  return {t, u, v, inside, std::fabs(volume) / (area * length(d)), longest * longest / area};
}

/// Three points in the box: regular triangles to needles, large to small.
std::array<Vec, 3> random_corners(Random& random) {
  const Real size = random.chance(0.3) ? random.spread(1e-8, 1) : 1;
  const Vec a = random.vector(0.5);
  const Vec b = a + size * Vec(random.vector(0.5));
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

TEST(TriangleHits, MatchCramersRuleForRandomRays) {
  Random random(1);
  std::uint64_t tried = 0, certain = 0, hit_count = 0;
  const std::uint64_t scenes = effort::cases(2800);
  for (std::uint64_t scene = 0; scene < scenes; ++scene) {
    GeometrySet set;
    const auto corners = random_corners(random);
    set.triangles.push_back(triangle_of(corners));
    const auto accelerator = built(set);
    std::vector<TestRay> rays;
    for (int i = 0; i < 401; ++i) rays.push_back(random_ray(random, corners));
    const RayBatch batch(rays);
    const auto found = batch.intersect(*accelerator, Coherence::incoherent);
    const auto blocked = batch.occluded(*accelerator, Coherence::coherent);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Expected e = expected_for(set.triangles[0], rays[i]);
      // Sheared vertices, two for each edge: a subtraction, two products and a subtraction, of numbers up to the
      // distance.
      const Real error_bound = 16 * 0x1p-53L * (1 + length(Vec(rays[i].origin)));
      const Real t_tolerance = error_bound * (2 + e.slimness / e.sine);
      ++tried;
      if (!(std::fabs(e.inside) * e.sine > error_bound) || std::fabs(e.t - rays[i].t_max) <= t_tolerance) continue;
      ++certain;
      const bool expected = e.inside > 0 && e.t < rays[i].t_max;
      hit_count += expected ? 1 : 0;
      ASSERT_EQ(found[i].primitive.hit(), expected)
          << "inside " << static_cast<double>(e.inside) << " sine " << static_cast<double>(e.sine);
      ASSERT_EQ(blocked[i], expected);
      if (!expected) continue;
      ASSERT_LE(std::fabs(found[i].t - e.t), t_tolerance);
      const Real longest = std::fmax(length(corners[1] - corners[0]), length(corners[2] - corners[0]));
      const Real weight_tolerance = error_bound * e.slimness / (e.sine * longest);
      ASSERT_LE(std::fabs(found[i].u - e.u), weight_tolerance);
      ASSERT_LE(std::fabs(found[i].v - e.v), weight_tolerance);
    }
  }
  RecordProperty("certain", static_cast<int>(certain));
  EXPECT_GT(certain, tried / 2) << "most cases must be certain";
  EXPECT_GT(hit_count, certain / 4);
  EXPECT_LT(hit_count, certain * 3 / 4);
}

TEST(TriangleHits, HaveTheBarycentricCoordinatesOfTheSecondAndThirdCorner) {
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(300); ++i) {
    const std::array<Vec, 3> corners{Vec(random.vector(0.5)), random.vector(0.5), random.vector(0.5)};
    const Vec n = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (length(n) < 0.01L) continue;
    GeometrySet set;
    set.triangles.push_back(triangle_of(corners));
    const auto accelerator = built(set);
    const Real u = random.in(0.1, 0.8), v = random.in(0.05, 0.9 - static_cast<double>(u));
    const Vec a = set.triangles[0].position(0), b = set.triangles[0].position(1), c = set.triangles[0].position(2);
    const Vec target = (1 - u - v) * a + u * b + v * c;
    const Vec origin = target + random.sign() * unit(n) + Real(0.3) * random.across(unit(n));
    const auto hits = RayBatch({TestRay{rounded(origin), rounded(unit(target - origin))}})
                          .intersect(*accelerator, Coherence::coherent);
    ASSERT_TRUE(hits[0].primitive.hit());
    ASSERT_NEAR(hits[0].u, static_cast<double>(u), 1e-12);
    ASSERT_NEAR(hits[0].v, static_cast<double>(v), 1e-12);
  }
}

TEST(TriangleHits, AreOnTheLowestOfCoincidentTriangles) {
  Random random(3);
  GeometrySet set;
  const std::array<Vec, 3> corners{Vec{-0.5, -0.5, 0}, Vec{0.5, -0.5, 0.1L}, Vec{0, 0.5, -0.1L}};
  for (int copy = 0; copy < 5; ++copy) set.triangles.push_back(triangle_of(corners));
  const auto accelerator = built(set);
  std::vector<TestRay> rays;
  for (int i = 0; i < 501; ++i) {
    const Vec origin = 2 * random.direction();
    rays.push_back({rounded(origin), rounded(unit(random.in(0, 0.1) * random.direction() - origin))});
  }
  int hit_count = 0;
  for (const TestHit& hit : RayBatch(rays).intersect(*accelerator, Coherence::incoherent)) {
    if (!hit.primitive.hit()) continue;
    ++hit_count;
    ASSERT_EQ(hit.primitive.geometry, 0u);
  }
  EXPECT_GT(hit_count, 400);
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
