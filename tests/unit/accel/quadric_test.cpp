// Hits of discs, cylinders, cones, boxes, ellipsoids and tori, plain and under affine maps, against all crossings in
// long double.

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/expected_hits.h"
#include "tests/unit/accel/quadric_oracle.h"

namespace tracer {
namespace {

using oracle::Random;

// ---- cases ---------------------------------------------------------------------------------------------------------

Quadric random_quadric(Random& random, QuadricKind kind, bool mapped) {
  const double size = random.spread(1e-6, 0.3);
  Affine map{{{size, 0, 0}, {0, size, 0}, {0, 0, size}}, random.vector(0.2)};
  if (mapped) {
    // Turned, stretched, sheared; half of them mirrored.
    do {
      const auto column = [&] {
        return rounded(static_cast<Real>(size * random.spread(0.05, 1)) * random.direction());
      };
      map.linear = {column(), column(), column()};
    } while (std::abs(determinant({normalize(map.linear.x), normalize(map.linear.y), normalize(map.linear.z)})) < 0.02);
  }
  Quadric q = quadric(kind, map);
  if (kind == kind_of<UnitTorus>) q.radius_0 = random.chance(0.5) ? random.spread(1e-6, 0.9) : random.in(0.1, 0.999);
  if (kind == kind_of<UnitDisc>) q.radius_0 = random.chance(0.5) ? 0 : random.in(0.05, 0.95);
  if (kind == kind_of<Frustum>) {
    q.caps = random.chance(0.7);
    if (random.chance(0.7))
      (random.chance(0.5) ? q.radius_0 : q.radius_1) = random.chance(0.5) ? 0 : random.in(0.01, 1);
  }
  return q;
}

/// A point of interest on the shape, in its own space: anywhere on it, a rim, an edge, a corner, the apex, the axis.
Vec target_of(Random& random, const Quadric& q) {
  const Real turn = 6.2831853071795864769L * random.in(0, 1), x = std::cos(turn), y = std::sin(turn);
  switch (q.kind) {
    case kind_of<UnitSphere>:
      return random.chance(0.5) ? random.direction() : random.in(0, 1.2) * random.direction();
    case kind_of<UnitTorus>: {
      const Real tube = 6.2831853071795864769L * random.in(0, 1), a = q.radius_0;
      const Real r = 1 + a * std::cos(tube) * (random.chance(0.7) ? 1 : random.in(0, 1.5));
      return {r * x, r * y, a * std::sin(tube) * (random.chance(0.7) ? 1 : random.in(0, 1.5))};
    }
    case kind_of<UnitDisc>: {
      const Real r = random.chance(0.3) ? 1 : random.chance(0.3) ? q.radius_0 : random.in(0, 1.2);
      return {r * x, r * y, 0};
    }
    case kind_of<Frustum>: {
      const Real z = random.chance(0.3) ? random.below(2) : random.in(-0.2, 1.2);
      const Real rim = q.radius_0 + (q.radius_1 - q.radius_0) * z;
      const Real r = random.chance(0.6) ? rim : random.chance(0.2) ? 0 : random.in(0, 1) * rim;
      return {r * x, r * y, z};
    }
    case kind_of<UnitCube>: {
      const auto coordinate = [&]() -> Real { return random.chance(0.35) ? random.below(2) : random.in(-0.1, 1.1); };
      return {coordinate(), coordinate(), coordinate()};
    }
  }
  return {};
}

/// In the shape's space: from inside, near, or far away; the direction past a point of interest, along an axis, within
/// a face, along the side.
Line random_line(Random& random, const Quadric& q) {
  Line line;
  const Vec target = target_of(random, q);
  line.d = random.direction();
  switch (random.below(6)) {
    case 0:
      line.d = {0, 0, 0};
      (random.below(3) == 0 ? line.d.x : random.below(2) == 0 ? line.d.y : line.d.z) = random.sign();
      break;
    case 1: {  // along the side, or nearly
      const Real r = std::hypot(target.x, target.y);
      if (q.kind == kind_of<UnitTorus>) {  // across the normal, or nearly
        const Vec out(target.x / r, target.y / r, 0);
        const Vec normal = unit(target - out);
        const Real tilt = random.chance(0.3) ? 0 : random.spread(1e-12, 1e-2);
        line.d = unit(random.across(normal) + tilt * normal);
      }
      if (r > 0 && q.kind == kind_of<Frustum>) {
        const Real slope = Real(q.radius_1) - q.radius_0;
        line.d = Vec(target.x / r * slope, target.y / r * slope, 1) +
                 static_cast<Real>(random.chance(0.5) ? 0 : random.spread(1e-15, 1e-3)) * random.direction();
        line.d = static_cast<Real>(random.sign()) * unit(line.d);
      }
      break;
    }
    case 2: {  // nearly within a face or cap
      line.d.z *= random.spread(1e-15, 1e-2);
      line.d = unit(line.d);
      break;
    }
    default:
      break;
  }
  const Real back = random.chance(0.15) ? random.spread(1e-9, 1e-3) : random.chance(0.15) ? 1e6 : random.in(0, 4);
  line.o = target - back * line.d;
  return line;
}

GeometrySet set_of(const Quadric& q) {
  GeometrySet set;
  set.quadrics.push_back({{q}, {0}});
  return set;
}

/// The nearest crossing; u is its part, unless another crossing is as near.
ExpectedHit expected_for(const Quadric& q, const Map& map, const TestRay& ray) {
  const Line line{map.shape_point(ray.origin), map.shape_direction(ray.direction)};
  const Crossings crossings = crossings_of(q, line);
  // Rounding in the shape's space: of its coordinates there, and of the map.
  const Real reach = length(Vec(ray.origin) - Vec(q.origin));
  const Real error_bound = 64 * 0x1p-53L * (1 + length(line.o) + map.growth() * reach);
  Crossing nearest{.t = infinity};
  Real second = infinity, margin = crossings.margin;
  for (const Crossing& crossing : crossings.all) {
    margin = std::fmin(margin, crossing.margin);
    const bool starts_on_it = std::fabs(crossing.t) * length(line.d) * crossing.steepness < 4 * error_bound;
    if (starts_on_it) return {};
    if (crossing.t <= 0) continue;
    second = std::fmin(second, std::fmax(crossing.t, nearest.t));
    if (crossing.t < nearest.t) nearest = crossing;
  }
  const Real slack = 2 * error_bound / (nearest.steepness * length(line.d));
  // Only the nearest crossing must be certain; the margins of those behind it exclude more than necessary.
  if (margin < 4 * error_bound || std::fabs(nearest.t - ray.t_max) < slack) return {};
  const Real part_error = second - nearest.t > 2 * slack ? 0 : infinity;
  return {nearest.t < ray.t_max, nearest.t, slack, Real(static_cast<int>(nearest.part)), part_error};
}

void try_kind(QuadricKind kind, bool mapped, std::uint64_t seed) {
  Random random(seed);
  HitCounts counts;
  const std::uint64_t shapes = effort::cases(kind == kind_of<UnitTorus> ? 40 : 1400);  // its oracle is slow
  for (std::uint64_t shape = 0; shape < shapes && !testing::Test::HasFailure(); ++shape) {
    const Quadric q = random_quadric(random, kind, mapped);
    const Map map(q);
    std::vector<TestRay> rays;
    while (rays.size() < 365) {  // not a multiple of sixteen
      const Line line = random_line(random, q);
      TestRay ray;
      ray.origin = rounded(map.point(line.o));
      ray.direction = rounded(unit(map.point(line.d) - map.offset));
      if (random.chance(0.15))
        ray.t_max = static_cast<double>(length(Vec(ray.origin) - map.offset)) * random.in(0.3, 1.7);
      rays.push_back(ray);
    }
    SCOPED_TRACE(testing::Message() << "radii " << q.radius_0 << " " << q.radius_1);
    const auto expected = [&](std::size_t, const TestRay& ray) { return expected_for(q, map, ray); };
    expect_nearest(set_of(q), {{{0, 0}}}, rays, expected, counts);
  }
  EXPECT_GT(counts.certain, counts.tried * 3 / 10) << "most cases must be certain";
  EXPECT_GT(counts.hits, counts.certain / 8);
  EXPECT_LT(counts.hits, counts.certain);
}

TEST(EllipsoidHits, MatchAllCrossingsForRandomRays) { try_kind(kind_of<UnitSphere>, false, 1); }
TEST(EllipsoidHits, MatchAllCrossingsUnderAffineMaps) { try_kind(kind_of<UnitSphere>, true, 2); }
TEST(DiscHits, MatchAllCrossingsForRandomRays) { try_kind(kind_of<UnitDisc>, false, 3); }
TEST(DiscHits, MatchAllCrossingsUnderAffineMaps) { try_kind(kind_of<UnitDisc>, true, 4); }
TEST(CylinderAndConeHits, MatchAllCrossingsForRandomRays) { try_kind(kind_of<Frustum>, false, 5); }
TEST(CylinderAndConeHits, MatchAllCrossingsUnderAffineMaps) { try_kind(kind_of<Frustum>, true, 6); }
TEST(BoxHits, MatchAllCrossingsForRandomRays) { try_kind(kind_of<UnitCube>, false, 7); }
TEST(BoxHits, MatchAllCrossingsUnderAffineMaps) { try_kind(kind_of<UnitCube>, true, 8); }

TEST(TorusHits, MatchAllCrossingsForRandomRays) { try_kind(kind_of<UnitTorus>, false, 9); }
TEST(TorusHits, MatchAllCrossingsUnderAffineMaps) { try_kind(kind_of<UnitTorus>, true, 10); }

// ---- cases within the margins of the oracle ------------------------------------------------------------------------

TestHit single(const Quadric& q, const Vec3& origin, const Vec3& direction) {
  return RayBatch({{origin, direction}}).intersect(*built(set_of(q)), Coherence::incoherent)[0];
}

Quadric standard(QuadricKind kind) { return quadric(kind, {}); }

TEST(BoxHits, OfRaysAlongTheAxesDoNotDependOnTheSignsOfZeros) {
  const Quadric box = standard(kind_of<UnitCube>);
  for (const double zero : {0.0, -0.0})
    for (const double other : {0.0, -0.0})
      for (const double y : {0.0, 0.25, 1.0}) {
        EXPECT_EQ(single(box, {-1, y, 0.5}, {1, zero, other}).t, 1) << y;
        EXPECT_EQ(single(box, {2, y, 1}, {-1, zero, other}).t, 1) << y;
        EXPECT_EQ(single(box, {0.25, y, 0.5}, {-1, zero, other}).t, 0.25) << "from inside";
        EXPECT_FALSE(single(box, {-1, 1.5, 0.5}, {1, zero, other}).primitive.hit());
        EXPECT_FALSE(single(box, {-1, -0.5, 0.5}, {1, zero, other}).primitive.hit());
      }
}

TEST(CylinderAndConeHits, OfRaysAlongTheAxisAreOnTheCaps) {
  Quadric cone = standard(kind_of<Frustum>);
  EXPECT_EQ(single(cone, {0, 0, -2}, {0, 0, 1}).t, 2);
  EXPECT_EQ(single(cone, {1, 0, -2}, {0, 0, 1}).t, 2) << "the rim is closed";
  EXPECT_EQ(single(cone, {0.5, 0, 0.5}, {0, 0, 1}).t, 0.5) << "from inside";
  cone.radius_1 = 0;
  EXPECT_EQ(single(cone, {0, 0, 3}, {0, 0, -1}).t, 2) << "the apex";
  EXPECT_EQ(single(cone, {0, 0, -3}, {0, 0, 1}).t, 3) << "the base";
  EXPECT_EQ(single(cone, {0.5, 0, 3}, {0, 0, -1}).t, 2.5) << "not the mirror nappe";
  EXPECT_FALSE(single(cone, {0, -3, 1.5}, {0, 1, 0}).primitive.hit()) << "nor across the mirror nappe";
  cone.caps = false;
  EXPECT_FALSE(single(cone, {1.5, 0, -1}, {0, 0, 1}).primitive.hit());
}

/// A convex shape is on one side of its tangent planes: lines outside of one miss it, and rays from inside leave
/// towards a closed end or an apex with a hit, even almost along the straight lines of the side.
TEST(CylinderAndConeHits, OfRaysNextToATangentPlaneAreNoneOutsideAndOneInside) {
  Random random(11);
  for (std::uint64_t tries = 0; tries < effort::cases(20'000); ++tries) {
    Quadric q = standard(kind_of<Frustum>);
    q.radius_1 = random.chance(0.3) ? 0 : random.in(0.05, 1);
    const Real slope = Real(q.radius_1) - q.radius_0, z = random.in(0.05, 0.9), turn = random.in(0, 7);
    const Vec round(std::cos(turn), std::sin(turn), 0), line = unit(slope * round + Vec(0, 0, 1));
    const Vec normal = unit(round + Vec(0, 0, -slope));
    const Vec beside = unit(line + static_cast<Real>(random.spread(1e-12, 1)) * cross(normal, line));
    const Vec along = static_cast<Real>(random.sign()) * beside;
    const bool inside = random.chance(0.5);
    // Rays leave open ends without a hit.
    q.caps = random.chance(0.7) || (inside && !(q.radius_1 == 0 && along.z > 0));
    // Beyond the rounding of the points, and far within the shape.
    const Real away = random.spread(1e-13, 1e-3) * (inside ? -1 : 1);
    const Vec origin = (q.radius_0 + slope * z) * round + Vec(0, 0, z) + away * normal;
    const TestHit hit = single(q, rounded(origin), rounded(along));
    ASSERT_EQ(hit.primitive.hit(), inside)
        << "caps " << q.caps << " radius " << q.radius_1 << " beside by " << static_cast<double>(away);
  }
}

TEST(DiscHits, ExcludeTheHoleAndIncludeBothRims) {
  Quadric disc = standard(kind_of<UnitDisc>);
  disc.radius_0 = 0.5;
  EXPECT_FALSE(single(disc, {0.25, 0, 1}, {0, 0, -1}).primitive.hit());
  EXPECT_TRUE(single(disc, {0.5, 0, 1}, {0, 0, -1}).primitive.hit());
  EXPECT_TRUE(single(disc, {0, 1, -1}, {0, 0, 1}).primitive.hit());
  EXPECT_FALSE(single(disc, {0, std::nextafter(1.0, 2), -1}, {0, 0, 1}).primitive.hit());
  EXPECT_FALSE(single(disc, {-3, 0, 0}, {1, 0, 0}).primitive.hit()) << "within its plane";
}

}  // namespace
}  // namespace tracer
