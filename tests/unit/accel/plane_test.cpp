// Hits of planes, against t = (p - o).n / d.n in long double.
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

struct Expected {
  Real t = 0, tolerance = 0;
  bool hit = false, certain = false;
};

Expected expected_for(const Vec3& point, const Vec3& normal, const TestRay& ray) {
  constexpr Real unit_roundoff = 0x1p-53L;
  const Vec n = normal, d = ray.direction, offset = Vec(point) - Vec(ray.origin);
  const Real slope = dot(n, d), t = dot(n, offset) / slope;
  // Three products and two sums each, of terms no larger than the lengths.
  const Real error_bound = 8 * unit_roundoff;
  Expected e;
  e.t = t;
  e.tolerance =
      (error_bound * (length(Vec(point)) + length(Vec(ray.origin))) + std::fabs(t) * error_bound) / std::fabs(slope) +
      error_bound * std::fabs(t);
  e.certain =
      std::fabs(slope) > 100 * error_bound && std::fabs(t) > e.tolerance && std::fabs(t - ray.t_max) > e.tolerance;
  e.hit = t > 0 && t < ray.t_max;
  return e;
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
  std::uint64_t certain = 0;
  const std::uint64_t scenes = effort::cases(3400);
  for (std::uint64_t scene = 0; scene < scenes; ++scene) {
    GeometrySet set;
    const std::uint32_t count = 1 + random.below(3);
    for (std::uint32_t p = 0; p < count; ++p) {
      const Vec3 axes[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
      add_plane(set.planes, random.vector(random.chance(0.1) ? 1e6 : 1),
                random.chance(0.3) ? axes[random.below(3)] : rounded(random.direction()));
    }
    set.planes.transmissive[0] = random.chance(0.3) ? 1 : 0;
    const auto accelerator = built(set);
    std::vector<TestRay> rays;
    for (int i = 0; i < 301; ++i) rays.push_back(random_ray(random, set.planes.normal[random.below(count)]));
    const RayBatch batch(rays);
    const auto found = batch.intersect(*accelerator, Coherence::incoherent);
    const auto blocked = batch.occluded(*accelerator, Coherence::incoherent);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Expected nearest;
      nearest.t = HUGE_VALL;
      bool all_certain = true, opaque = false;
      std::uint32_t expected = PrimitiveRef::none;
      for (std::uint32_t p = 0; p < count; ++p) {
        const Expected e = expected_for(set.planes.point[p], set.planes.normal[p], rays[i]);
        all_certain &= e.certain && !(e.hit && std::fabs(e.t - nearest.t) <= e.tolerance + nearest.tolerance);
        opaque |= e.hit && set.planes.transmissive[p] == 0;
        if (e.hit && e.t < nearest.t) nearest = e, expected = p;
      }
      if (!all_certain) continue;
      ++certain;
      ASSERT_EQ(found[i].primitive.primitive, expected) << "ray " << i << " of scene " << scene;
      ASSERT_EQ(blocked[i], opaque);
      if (expected == PrimitiveRef::none) continue;
      ASSERT_EQ(found[i].primitive.geometry, set.plane_geometry());
      ASSERT_LE(std::fabs(found[i].t - nearest.t), nearest.tolerance);
    }
  }
  EXPECT_GT(certain, scenes * 301 * 8 / 10) << "most cases must be certain";
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
