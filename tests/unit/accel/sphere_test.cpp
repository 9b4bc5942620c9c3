// Hits of spheres, against the roots of the quadratic in long double.

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// A sphere of any size in the render space's unit box, and a ray at it from anywhere.
struct Case {
  Vec3 center;
  double radius = 1;
  TestRay ray;
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

Case random_case(Random& random) {
  Case c;
  c.radius = random.spread(1e-9, 0.4);
  c.center = random.vector(0.5 - c.radius);
  if (random.chance(0.1)) c.center = {};  // where relative bounds vanish
  const Vec center = c.center, origin = origin_of(random, center, c.radius);
  Vec towards = unit(center - origin);
  const Real distance = length(center - origin);
  switch (random.below(4)) {
    case 0:  // at or past the silhouette
      towards = center + random.in(0, 1.5) * static_cast<Real>(c.radius) * random.across(towards) - origin;
      break;
    case 1: {  // grazing, nearer and nearer
      const Real r = c.radius * (1 + random.sign() * random.spread(1e-15, 1e-2));
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
  c.ray.origin = rounded(origin);
  c.ray.direction = rounded(unit(towards));
  if (random.chance(0.2)) c.ray.t_max = static_cast<double>(distance) * random.in(0, 2);
  return c;
}

/// Expected hit, in units of the box. Certain beyond the rounding error of the line in double.
struct Expected {
  bool hit = false, certain = false;
  Real t = 0, tolerance = 0;
};

Expected expected_for(const Case& c) {
  constexpr Real unit_roundoff = 0x1p-53L;
  const Vec f = Vec(c.ray.origin) - Vec(c.center), d = c.ray.direction;
  const Real r = c.radius, a = dot(d, d), b = -dot(f, d) / a;
  const Real error_bound = 16 * unit_roundoff * (length(f) + r);
  const Real miss = length(f + b * d);
  const Real discriminant = (r - miss) * (r + miss);
  Expected e;
  if (discriminant < 0) return {false, miss - r > error_bound, 0, 0};
  const Real root = std::sqrt(discriminant / a);
  const bool outside = length(f) > r;
  e.t = outside ? b - root : b + root;
  e.hit = e.t > 0 && e.t < c.ray.t_max;
  e.tolerance = error_bound * (2 + 2 * r / std::fmax(root, std::sqrt(2 * r * error_bound)));
  // Uncertain: at the silhouette, on the surface, at the ray's end.
  e.certain = r - miss > error_bound && std::fabs(length(f) - r) > error_bound &&
              std::fabs(e.t - c.ray.t_max) > e.tolerance && std::fabs(e.t) > e.tolerance;
  return e;
}

TEST(SphereHits, MatchTheQuadraticForRandomRaysAndSizes) {
  // One sphere in a scene of its own, 37 rays a packet pair and a bit: not a multiple of sixteen.
  Random random(1);
  std::uint64_t certain = 0, hits = 0;
  const std::uint64_t scenes = effort::cases(3000);
  for (std::uint64_t scene = 0; scene < scenes; ++scene) {
    const Case first = random_case(random);
    std::vector<Case> cases;
    std::vector<TestRay> rays;
    while (cases.size() < 37) {
      Case c = random_case(random);
      // The same sphere, the ray moved and scaled with it.
      const Real scale = static_cast<Real>(first.radius) / c.radius;
      const Vec offset = Vec(c.ray.origin) - Vec(c.center);
      c.ray.origin = rounded(Vec(first.center) + scale * offset);
      c.ray.t_max = static_cast<double>(scale * c.ray.t_max);
      c.center = first.center;
      c.radius = first.radius;
      cases.push_back(c);
      rays.push_back(c.ray);
    }
    GeometrySet set;
    set.spheres.emplace_back();
    add_sphere(set.spheres[0], first.center, first.radius);
    const auto accelerator = built(set);
    const RayBatch batch(rays);
    for (const Coherence coherence : {Coherence::coherent, Coherence::incoherent}) {
      const auto found = batch.intersect(*accelerator, coherence);
      const auto blocked = batch.occluded(*accelerator, coherence);
      for (std::size_t i = 0; i < cases.size(); ++i) {
        const Expected e = expected_for(cases[i]);
        if (!e.certain) continue;
        ++certain;
        hits += e.hit ? 1 : 0;
        const Case& c = cases[i];
        ASSERT_EQ(found[i].primitive.hit(), e.hit)
            << "radius " << c.radius << " origin " << c.ray.origin.x << " " << c.ray.origin.y << " " << c.ray.origin.z
            << " t " << e.t << " t_max " << c.ray.t_max;
        ASSERT_EQ(blocked[i], e.hit);
        if (e.hit) {
          ASSERT_LE(std::fabs(found[i].t - e.t), e.tolerance) << "radius " << c.radius << " expected " << e.t;
        }
      }
    }
  }
  EXPECT_GT(certain, scenes * 37 * 2 * 6 / 10) << "most cases must be certain";
  EXPECT_GT(hits, certain / 5);
}

struct BoundingSphere {
  Vec3 center;
  double radius;
};

/// Every `share`th ball lets light through: seen by closest, not by occluded, and alone among what does. Rays whose
/// answer rounding decides are left out; returns how many were not.
std::uint64_t expect_nearest(const std::vector<BoundingSphere>& spheres, const std::vector<TestRay>& rays,
                             std::uint32_t share) {
  GeometrySet set;
  set.spheres.resize(2);
  set.spheres[1].transmissive = true;
  std::vector<PrimitiveRef> refs;
  for (std::uint32_t i = 0; i < spheres.size(); ++i) {
    const std::uint32_t geometry = i % share == share - 1 ? 1 : 0;
    refs.push_back({geometry, static_cast<std::uint32_t>(set.spheres[geometry].x.size())});
    add_sphere(set.spheres[geometry], spheres[i].center, spheres[i].radius);
  }
  const auto accelerator = built(set);
  const RayBatch batch(rays);
  std::uint64_t checked = 0;
  for (const Coherence coherence : {Coherence::coherent, Coherence::incoherent}) {
    const auto found = batch.intersect(*accelerator, coherence);
    const auto through = batch.intersect(*accelerator, coherence, GeometryMask::transmissive);
    const auto blocked = batch.occluded(*accelerator, coherence);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Real nearest = HUGE_VALL, nearest_through = HUGE_VALL;
      PrimitiveRef who, who_through;
      bool certain = true, opaque = false;
      for (std::uint32_t s = 0; s < spheres.size(); ++s) {
        const Expected e = expected_for({spheres[s].center, spheres[s].radius, rays[i]});
        const bool transmissive = refs[s].geometry == 1;
        certain &= e.certain && !(e.hit && std::fabs(e.t - nearest) <= e.tolerance);
        certain &= !(e.hit && transmissive && std::fabs(e.t - nearest_through) <= e.tolerance);
        opaque |= e.hit && !transmissive;
        if (e.hit && e.t < nearest) nearest = e.t, who = refs[s];
        if (e.hit && transmissive && e.t < nearest_through) nearest_through = e.t, who_through = refs[s];
      }
      if (!certain) continue;
      ++checked;
      EXPECT_EQ(found[i].primitive, who) << "ray " << i << " at " << nearest;
      EXPECT_EQ(through[i].primitive, who_through) << "ray " << i << " at " << nearest_through;
      EXPECT_EQ(blocked[i], opaque) << "ray " << i;
      if (testing::Test::HasFailure()) return checked;
    }
  }
  return checked;
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

/// In the scene's box, of radii from `least` to a tenth of it.
std::vector<BoundingSphere> random_spheres(Random& random, std::size_t count, double least) {
  std::vector<BoundingSphere> spheres;
  while (spheres.size() < count) {
    const double radius = random.spread(least, 0.1);
    spheres.push_back({random.vector(0.5 - radius), radius});
  }
  return spheres;
}

TEST(SphereHits, AreTheNearestOfManySpheresForEveryRay) {
  Random random(2);
  const std::vector<BoundingSphere> spheres = random_spheres(random, 300, 1e-9);
  EXPECT_GT(expect_nearest(spheres, rays_at(random, spheres, 300, 1.1), 2), effort::cases(20'000));
}

TEST(SphereHits, AreTheSameWhereFewSpheresLetLightThrough) {
  // They then have a tree of their own.
  Random random(5);
  const std::vector<BoundingSphere> spheres = random_spheres(random, 100, 1e-4);
  EXPECT_GT(expect_nearest(spheres, rays_at(random, spheres, 100, 1.1), 10), effort::cases(20'000));
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
  EXPECT_GT(expect_nearest(spheres, rays_at(random, spheres, 8, 0.9), 2), effort::cases(20'000));
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
