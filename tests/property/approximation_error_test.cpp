// The stated error of approximations, and the rays that it takes to find it.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/compare.h"

namespace {

using namespace tracer;

constexpr Approximations shadows_none{.shadows = Approximations::Shadows::none};
constexpr Approximations reflections_none{.reflections = Approximations::Reflections::none};

Rendered rendered(Scene scene, std::uint32_t samples, const Approximations& approximations = {}) {
  scene.accuracy.samples = samples;
  scene.accuracy.approximate = approximations;
  return scenes::render(scene, 2);
}

/// A white floor from above, and a few small spheres whose shadows cover from a part of a pixel to some 20 pixels.
Scene small_shadows(std::uint64_t seed) {
  oracle::Random random(seed);
  Scene scene = scenes::empty(48, {{0, 10, 0}, {0, 0, 0}, {0, 0, -1}, 45});
  scene.lights = {scenes::point_light({3, 8, 1})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.8, 0.8}));
  for (std::uint32_t i = 0, spheres = 1 + random.below(3); i < spheres; ++i)
    scenes::add(scene, Sphere{{random.in(-3, 3), random.in(0.5, 2), random.in(-3, 3)}, random.spread(0.03, 0.4)},
                scenes::matte({0.6, 0.2, 0.1}));
  return scene;
}

/// Claims that are below the distance of the images of many samples, and claims that are above three times that.
struct Claims {
  int count = 0, wrong = 0, wide = 0;
  std::string first_wrong{};

  void add(const Scene& scene, const Approximations& approximations, std::uint32_t samples, const std::string& name) {
    constexpr std::uint32_t many = 64;
    const Image exact = rendered(scene, many).image, seen = rendered(scene, many, approximations).image;
    const double truth = compare(to_display(exact, scene.output), to_display(seen, scene.output))->rmse,
                 claim = rendered(scene, samples, approximations).error.approximation;
    ++count;
    if (claim > 3 * truth) ++wide;
    if (claim >= truth) return;
    if (wrong++ == 0) first_wrong = name + ": " + std::to_string(claim) + " for " + std::to_string(truth);
  }
};

TEST(ApproximationLooks, TakeATenthOfTheRays) {
  std::uint64_t all = 0, all_alone = 0;
  const auto expect_few = [&](std::uint64_t rays, std::uint64_t alone, std::uint64_t seed) {
    EXPECT_LE(rays, alone * 5 / 4) << "a look at glass takes many more rays than others: " << seed;
    all += rays;
    all_alone += alone;
  };
  for (std::uint64_t seed = 0; seed < effort::cases(60); ++seed) {
    const std::uint32_t side = 8 + 8 * static_cast<std::uint32_t>(seed % 8), samples = 1U << (seed % 5);
    const Scene scene = scenes::random(seed, side);
    Scene shadowless = scene, dull = scene;
    for (Light& light : shadowless.lights) light.shadows = false;
    for (Material& material : dull.materials) material.reflection = 0;
    expect_few(rendered(scene, samples, shadows_none).statistics.rays.total(),
               rendered(shadowless, samples).statistics.rays.total(), seed);
    if (std::ranges::any_of(scene.materials, [](const Material& m) { return m.transmission > 0; }))
      continue;  // glass would need a twin of its own
    expect_few(rendered(scene, samples, reflections_none).statistics.rays.total(),
               rendered(dull, samples).statistics.rays.total(), seed);
  }
  EXPECT_LE(all, all_alone * 11 / 10);
  EXPECT_GE(all, all_alone * 102 / 100) << "what may be spent is spent";
}

TEST(ApproximationLooks, IsClaimedByFewLooks) {
  const std::vector<Approximations> all = {
      shadows_none, reflections_none, {.reflections = Approximations::Reflections::environment}, {.nearest_lights = 1}};
  for (const std::uint32_t samples : {1U, 4U, 16U}) {
    Claims claims;
    for (std::uint64_t seed = 0; seed < effort::cases(40); ++seed)
      for (std::size_t i = 0; i < all.size(); ++i)
        claims.add(scenes::random(seed, 48), all[i], samples, std::to_string(seed) + '.' + std::to_string(i));
    EXPECT_LE(claims.wrong, claims.count / 20 + 1) << samples << " samples, first " << claims.first_wrong;
    EXPECT_LT(claims.wide, samples < 16 ? claims.count + 1 : claims.count * 3 / 4) << "many have no effect at all";
  }
}

TEST(ApproximationLooks, IncludesSmallShadows) {
  for (const std::uint32_t samples : {1U, 4U, 16U}) {
    Claims claims;
    for (std::uint64_t seed = 0; seed < effort::cases(100); ++seed)
      claims.add(small_shadows(seed), shadows_none, samples, std::to_string(seed));
    EXPECT_LE(claims.wrong, claims.count / 20 + 1) << samples << " samples, first " << claims.first_wrong;
  }
}

}  // namespace
