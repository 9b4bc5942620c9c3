// The cheap test of cylinders and cones rejects no line that the exact intersection hits.

#include "tracer/src/shapes/frustum.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;

struct Line {
  ShapeRay ray;
  double radius_0, radius_1;
};

/// A line to the side's surface, or at a distance of a fraction of the radius; from near and far, some along the axis
/// or along the side.
Line aimed_at_side(Random& random, double beyond) {
  const double radius_1 = random.chance(0.4) ? 1 : random.chance(0.3) ? 0 : std::exp2(random.in(-40, 0));
  const double z = random.in(0, 1), angle = random.in(0, 2 * std::acos(-1.0));
  const double radius = (1 + (radius_1 - 1) * z) * (1 + beyond);
  const Vec3 outward{std::cos(angle), std::sin(angle), 0}, around{-outward.y, outward.x, 0};
  const Vec3 along_side = outward * (radius_1 - 1) + Vec3{0, 0, 1};
  // In the tangent plane, or tilted out of it by any small angle.
  const double turn = random.in(0, 2 * std::acos(-1.0));
  const double steep = random.chance(0.2) ? std::exp2(random.in(-40, 0)) : 1;
  const Vec3 direction = normalize(around * (std::cos(turn) * steep) + along_side * std::sin(turn) +
                                   outward * (random.chance(0.5) ? 0 : std::exp2(random.in(-50, 0)))) *
                         std::exp2(random.in(-3, 3));
  const double back = std::exp2(random.in(-3, 20)) / length(direction);
  const Vec3 origin = outward * radius + Vec3{0, 0, z} - direction * back;
  return {{origin.x, origin.y, origin.z, direction.x, direction.y, direction.z}, 1, radius_1};
}

TEST(MayHitFrustum, IsTrueForEveryLineThatHits) {
  Random random(11);
  std::uint64_t hits = 0;
  for (std::uint64_t i = 0; i < effort::cases(2'000'000); ++i) {
    const double side = random.chance(0.5) ? 1 : -1;
    const Line line = aimed_at_side(random, side * std::exp2(random.in(-54, -2)));
    const QuadricHit open = frustum_hit<false>(line.ray, line.radius_0, line.radius_1);
    const QuadricHit closed = frustum_hit<true>(line.ray, line.radius_0, line.radius_1);
    if (!(open.t < HUGE_VAL) && !(closed.t < HUGE_VAL)) continue;
    ++hits;
    ASSERT_TRUE(may_hit_frustum(line.ray, line.radius_0, line.radius_1))
        << line.ray.ox << ' ' << line.ray.oy << ' ' << line.ray.oz << " along " << line.ray.dx << ' ' << line.ray.dy
        << ' ' << line.ray.dz << ", radius " << line.radius_1 << " at the end";
  }
  EXPECT_GT(hits, effort::cases(2'000'000) / 10);
}

TEST(MayHitFrustum, IsFalseForLinesThatMissByAThousandthOfTheRadius) {
  Random random(12);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const double angle = random.in(0, 2 * std::acos(-1.0)), slant = random.in(-1, 1), back = random.in(1, 100);
    const Vec3 outward{std::cos(angle), std::sin(angle), 0};
    const Vec3 direction = normalize(Vec3{-outward.y, outward.x, slant});
    const Vec3 origin = outward * 1.001 + Vec3{0, 0, random.in(0, 1)} - direction * back;
    EXPECT_FALSE(may_hit_frustum({origin.x, origin.y, origin.z, direction.x, direction.y, direction.z}, 1, 1));
  }
}

}  // namespace
}  // namespace tracer
