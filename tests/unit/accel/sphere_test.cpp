// Hits of spheres, against the roots of the quadratic in long double.

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/expected_hits.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

struct BoundingSphere {
  Vec3 center;
  double radius;
};

/// Random origin of a ray, relative to the sphere.
Vec origin_of(Random& random, const Vec& center, Real radius) {
  switch (random.below(5)) {
    case 0:  // inside
      return center + random.in(0, 0.999) * radius * random.direction();
    case 1:  // near the surface, on either side
      return center + (1 + random.sign() * random.spread(1e-9, 0.5)) * radius * random.direction();
    case 2:  // a million radii away
      return center + 1e6L * radius * random.direction();
    case 3:  // a million million boxes away
      return center + 1e12L * random.direction();
    default:
      return random.vector(1);
  }
}

/// A ray at the sphere from anywhere.
TestRay random_ray(Random& random, const BoundingSphere& sphere) {
  const Vec center = sphere.center, origin = origin_of(random, center, sphere.radius);
  Vec towards = unit(center - origin);
  const Real distance = length(center - origin);
  switch (random.below(4)) {
    case 0:  // at or past the silhouette
      towards = center + random.in(0, 1.5) * static_cast<Real>(sphere.radius) * random.across(towards) - origin;
      break;
    case 1: {  // grazing, nearer and nearer
      const Real r = sphere.radius * (1 + random.sign() * random.spread(1e-15, 1e-2));
      if (distance > r) {
        const Real sine = r / distance;
        towards = std::sqrt((1 - sine) * (1 + sine)) * towards + sine * random.across(towards);
      }
      break;
    }
    case 2:  // along an axis: two components are nothing, of either sign
      towards = Vec{random.sign() * 0.0, random.sign() * 0.0, random.sign() * 0.0};
      (random.below(3) == 0 ? towards.x : random.below(2) == 0 ? towards.y : towards.z) = random.sign();
      break;
    default:
      towards = random.direction();
  }
  TestRay ray{rounded(origin), rounded(unit(towards))};
  if (random.chance(0.2)) ray.t_max = static_cast<double>(distance) * random.in(0, 2);
  return ray;
}

/// Certain beyond the rounding error of the line in double.
ExpectedHit expected_for(const BoundingSphere& sphere, const TestRay& ray) {
  constexpr Real unit_roundoff = 0x1p-53L;
  const Vec f = Vec(ray.origin) - Vec(sphere.center), d = ray.direction;
  const Real r = sphere.radius, a = dot(d, d), b = -dot(f, d) / a;
  const Real error_bound = 16 * unit_roundoff * (length(f) + r);
  const Real miss = length(f + b * d);
  const Real discriminant = (r - miss) * (r + miss);
  if (miss - r > error_bound) return {false};
  if (r - miss <= error_bound || std::fabs(length(f) - r) <= error_bound)
    return {};  // at the silhouette, on the surface
  const Real root = std::sqrt(discriminant / a);
  const Real t = length(f) > r ? b - root : b + root;
  const Real t_error = error_bound * (2 + 2 * r / std::fmax(root, std::sqrt(2 * r * error_bound)));
  if (std::fabs(t - ray.t_max) <= t_error || std::fabs(t) <= t_error) return {};  // at the ray's ends
  return {t > 0 && t < ray.t_max, t, t_error};
}

/// Every `share`th sphere lets light through.
void expect_nearest(const std::vector<BoundingSphere>& spheres, const std::vector<TestRay>& rays, std::uint32_t share,
                    HitCounts& counts) {
  GeometrySet set;
  set.spheres.resize(2);
  set.spheres[1].transmissive = true;
  std::vector<Target> targets;
  for (std::uint32_t i = 0; i < spheres.size(); ++i) {
    const std::uint32_t geometry = i % share == share - 1 ? 1 : 0;
    targets.push_back({{geometry, static_cast<std::uint32_t>(set.spheres[geometry].x.size())}, geometry == 1});
    add_sphere(set.spheres[geometry], spheres[i].center, spheres[i].radius);
  }
  const auto expected = [&](std::size_t i, const TestRay& ray) { return expected_for(spheres[i], ray); };
  expect_nearest(set, targets, rays, expected, counts);
}

TEST(SphereHits, MatchTheQuadraticForRandomRaysAndSizes) {
  Random random(1);
  HitCounts counts;
  for (std::uint64_t scene = 0; scene < effort::cases(3000) && !HasFailure(); ++scene) {
    const double radius = random.spread(1e-9, 0.4);
    // Relative bounds vanish at the middle of the scene.
    const BoundingSphere sphere{random.chance(0.1) ? Vec3{} : random.vector(0.5 - radius), radius};
    std::vector<TestRay> rays;
    while (rays.size() < 37) rays.push_back(random_ray(random, sphere));  // a packet pair and a bit
    expect_nearest({sphere}, rays, 2, counts);
  }
  EXPECT_GT(counts.certain, counts.tried * 6 / 10) << "most cases must be certain";
  EXPECT_GT(counts.hits, counts.certain / 5);
}

/// Rays at points within `reach` radii of the middle of some ball of the first `aims`.
std::vector<TestRay> rays_at(Random& random, const std::vector<BoundingSphere>& spheres, std::uint32_t aims,
                             double reach) {
  std::vector<TestRay> rays;
  for (std::uint64_t i = 0; i < effort::cases(20'000) + 5; ++i) {
    const Vec origin = random.chance(0.3) ? Vec(random.vector(0.5)) : 3 * random.direction();
    const BoundingSphere& ball = spheres[random.below(aims)];
    const Vec target = Vec(ball.center) + random.in(0, reach) * static_cast<Real>(ball.radius) * random.direction();
    rays.push_back({rounded(origin), rounded(unit(target - origin))});
  }
  return rays;
}

TEST(SphereHits, AreTheNearestOfManySpheresForEveryRay) {
  Random random(2);
  std::vector<BoundingSphere> spheres;
  while (spheres.size() < 300) {
    const double radius = random.spread(1e-9, 0.1);
    spheres.push_back({random.vector(0.5 - radius), radius});
  }
  const std::vector<TestRay> rays = rays_at(random, spheres, 300, 1.1);
  HitCounts counts;
  for (const std::uint32_t share : {2u, 10u}) expect_nearest(spheres, rays, share, counts);  // a tenth has its own tree
  EXPECT_GT(counts.certain, counts.tried / 2);
}

TEST(SphereHits, AreNotLostOnSpheresOfABillionthOfTheSceneAtItsVeryMiddle) {
  // There floats have more digits than the ray that Embree sees: boxes must be padded by what the ray lacks.
  Random random(4);
  std::vector<BoundingSphere> spheres;
  for (int i = 0; i < 8; ++i) spheres.push_back({random.vector(1e-8), random.spread(1e-9, 1e-8)});
  while (spheres.size() < 60) {
    const BoundingSphere ball{random.vector(0.4), 0.03};
    if (length(Vec(ball.center)) > 0.1L) spheres.push_back(ball);
  }
  HitCounts counts;
  expect_nearest(spheres, rays_at(random, spheres, 8, 0.9), 2, counts);
  EXPECT_GT(counts.certain, counts.tried / 2);
}

TEST(SphereHits, NeverComeFromRaysThatAreNotNumbersAndTheirNeighboursInThePacketDoNotNotice) {
  GeometrySet set;
  set.spheres.emplace_back();
  add_sphere(set.spheres[0], {0, 0, 0}, 0.5);
  add_plane(set.planes, {0, -0.5, 0}, {0, 1, 0});
  const auto accelerator = built(set);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    for (int component = 0; component < 6; ++component) {
      std::vector<TestRay> rays(19, TestRay{{0, 0, 2}, {0, 0, -1}});
      for (const std::size_t lane : {std::size_t{0}, std::size_t{7}, std::size_t{18}}) {
        double* const at[] = {&rays[lane].origin.x,    &rays[lane].origin.y,    &rays[lane].origin.z,
                              &rays[lane].direction.x, &rays[lane].direction.y, &rays[lane].direction.z};
        *at[component] = bad;
      }
      const RayBatch batch(rays);
      const auto hits = batch.intersect(*accelerator, Coherence::coherent);
      const auto blocked = batch.occluded(*accelerator, Coherence::coherent);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool good = i != 0 && i != 7 && i != 18;
        EXPECT_EQ(hits[i].primitive.hit(), good) << "component " << component << " is " << bad << ", lane " << i;
        EXPECT_EQ(blocked[i], good);
        if (good) {
          EXPECT_EQ(hits[i].t, 1.5);
        }
      }
    }
}

}  // namespace
}  // namespace tracer
