// Hits of planes, against t = (p - o).n / d.n in long double.
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/expected_hits.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

ExpectedHit expected_for(const Vec3& point, const Vec3& normal, const TestRay& ray) {
  constexpr Real unit_roundoff = 0x1p-53L;
  const Vec n = normal, d = ray.direction, offset = Vec(point) - Vec(ray.origin);
  const Real slope = dot(n, d), t = dot(n, offset) / slope;
  // Three products and two sums each, of terms no larger than the lengths.
  const Real error_bound = 8 * unit_roundoff;
  const Real t_error =
      (error_bound * (length(Vec(point)) + length(Vec(ray.origin))) + std::fabs(t) * error_bound) / std::fabs(slope) +
      error_bound * std::fabs(t);
  if (std::fabs(slope) <= 100 * error_bound || std::fabs(t) <= t_error || std::fabs(t - ray.t_max) <= t_error)
    return {};
  return {t > 0 && t < ray.t_max, t, t_error};
}

TestRay random_ray(Random& random, const Vec& normal) {
  const Real reach = random.chance(0.2) ? random.spread(1, 1e12) : 1;
  Vec direction = random.direction();
  if (random.chance(0.3))  // grazing
    direction = unit(random.across(normal) + random.sign() * static_cast<Real>(random.spread(1e-14, 1e-2)) * normal);
  if (random.chance(0.2)) {
    const Vec axes[] = {{1, -0.0L, 0}, {0, -1, 0}, {-0.0L, 0, 1}};
    direction = random.sign() * axes[random.below(3)];
  }
  TestRay ray{rounded(reach * random.direction()), rounded(direction)};
  if (random.chance(0.3)) ray.t_max = random.spread(1e-3, 10) * static_cast<double>(reach);
  return ray;
}

TEST(PlaneHits, AreOnTheNearestPlane) {
  Random random(1);
  HitCounts counts;
  for (std::uint64_t scene = 0; scene < effort::cases(3400) && !HasFailure(); ++scene) {
    GeometrySet set;
    std::vector<Target> targets;
    const std::uint32_t count = 1 + random.below(3);
    for (std::uint32_t p = 0; p < count; ++p) {
      const Vec3 axes[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
      add_plane(set.planes, random.vector(random.chance(0.1) ? 1e6 : 1),
                random.chance(0.3) ? axes[random.below(3)] : rounded(random.direction()));
      targets.push_back({{set.plane_geometry(), p}, p == 0 && random.chance(0.3)});
      set.planes.transmissive[p] = targets[p].transmissive ? 1 : 0;
    }
    std::vector<TestRay> rays;
    for (int i = 0; i < 301; ++i) rays.push_back(random_ray(random, set.planes.normal[random.below(count)]));
    const auto expected = [&](std::size_t p, const TestRay& ray) {
      return expected_for(set.planes.point[p], set.planes.normal[p], ray);
    };
    expect_nearest(set, targets, rays, expected, counts);
  }
  EXPECT_GT(counts.certain, counts.tried * 8 / 10) << "most cases must be certain";
}

TEST(PlaneHits, ExcludeParallelRaysAndRaysThatStartOnThePlane) {
  GeometrySet set;
  add_plane(set.planes, {0, 0, 0}, {0, 1, 0});
  const auto accelerator = built(set);
  const PrimitiveRef self{set.plane_geometry(), 0};
  const double all = HUGE_VAL;
  const std::vector<TestRay> rays{
      {{0, 1, 0}, {1, 0, 0}},                  // parallel, above
      {{0, 0, 0}, {1, 0, 0}},                  // parallel, within: 0/0
      {{0, 1e-17, 0}, {0, -1, 0}, all, self},  // rounding put its start on the wrong side
      {{0, 1, 0}, {0, 1, 0}},                  // away
      {{0, 1, 0}, {0, -1, 0}, 0.5},            // too short
  };
  for (const TestHit& hit : RayBatch(rays).intersect(*accelerator, Coherence::coherent))
    EXPECT_FALSE(hit.primitive.hit());
  for (const bool blocked : RayBatch(rays).occluded(*accelerator, Coherence::coherent)) EXPECT_FALSE(blocked);
}

}  // namespace
}  // namespace tracer
