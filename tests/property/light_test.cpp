// Thousands of lights with culled shadow rays. Penumbrae have the width of similar triangles, and their radiance is the
// visible part of the light.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;

/// A floor under lamps that fade with the square of their distance, balls on it, a mirror to see it twice.
Scene hall(std::size_t lamps, double cutoff) {
  Scene scene = scenes::empty(24, {{0, 6, 14}, {0, 0, 0}, {0, 1, 0}, 60});
  scene.accuracy.cutoff = cutoff;
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.6, 0.4}));
  scenes::add(scene, Sphere{{-2, 1, 0}, 1}, scenes::mirror(0.5));
  scenes::add(scene, Sphere{{2, 1, 1}, 1}, scenes::matte({0.2, 0.9, 0.5}));
  oracle::Random random(7);
  for (std::size_t i = 0; i < lamps; ++i) {
    Light lamp = scenes::point_light({random.in(-60, 60), random.in(0.2, 3), random.in(-60, 60)});
    lamp.attenuation.kind = Attenuation::Kind::inverse_square;
    lamp.intensity = 0.05;
    scene.lights.push_back(lamp);
  }
  return scene;
}

TEST(ManyLights, CullNegligibleRaysAndReportABoundOfTheOmittedRadiance) {
  const double cutoff = 1e-2;
  const Rendered all = scenes::render(hall(2000, 0)), some = scenes::render(hall(2000, cutoff));
  EXPECT_EQ(all.statistics.culled_shadow_rays, 0u);
  const auto possible = static_cast<double>(some.statistics.rays.shadow + some.statistics.culled_shadow_rays);
  EXPECT_NEAR(possible / static_cast<double>(all.statistics.rays.shadow), 1.05, 0.05) << "with the looks";
  EXPECT_LT(some.statistics.rays.shadow * 5, all.statistics.rays.shadow) << "nine in ten lamps are far away";
  double missing = 0;
  for (std::size_t i = 0; i < all.image.rgb.size(); ++i) {
    const double lost = double{all.image.rgb[i]} - double{some.image.rgb[i]};
    EXPECT_GE(lost, -1e-6 * all.image.rgb[i]);  // floats
    EXPECT_LE(lost, 2 * cutoff) << "a pixel has at most two hits";
    missing += lost;
  }
  const auto reported = static_cast<double>(some.statistics.culled_radiance) * 0x1p-20 * cutoff;
  EXPECT_GT(missing, 0);
  EXPECT_LE(missing / 3, reported);
}

TEST(ManyLights, CulledByChanceHaveTheMeanOfAll) {
  Scene scene = hall(2000, 0);
  const Rendered all = scenes::render(scene);
  scene.accuracy.cutoff.reset();
  double sum = 0, squares = 0, count = 0;
  for (scene.accuracy.seed = 0; scene.accuracy.seed < 20; ++scene.accuracy.seed) {
    const Rendered some = scenes::render(scene);
    EXPECT_EQ(some.error.cutoff, 0);
    EXPECT_LT(some.statistics.rays.shadow * 2, all.statistics.rays.shadow);
    for (std::size_t i = 0; i < all.image.rgb.size(); i += 3, ++count) {
      const double change = double{some.image.rgb[i]} - double{all.image.rgb[i]};
      sum += change;
      squares += change * change;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 5e-4);
  EXPECT_LT(std::abs(sum), 4 * std::sqrt(squares));
}

TEST(ManyLights, AreNotCulledBelowTheMinimumNumber) {
  const Rendered few = scenes::render(hall(64, 1e-2));
  EXPECT_FALSE(requirements(hall(64, 1e-2)).many_lights);
  EXPECT_TRUE(requirements(hall(65, 1e-2)).many_lights);
  EXPECT_EQ(few.statistics.culled_shadow_rays, 0u);
  EXPECT_EQ(few.image.rgb, scenes::render(hall(64, 0)).image.rgb);
}

TEST(ManyLights, GiveTheSameImageAndStatisticsForAnyNumberOfThreads) {
  const Scene scene = hall(300, 1e-2);
  const Rendered one = scenes::render(scene, 1), three = scenes::render(scene, 3);
  EXPECT_EQ(one.image.rgb, three.image.rgb);
  EXPECT_EQ(one.statistics, three.statistics);
}

TEST(AreaLights, HaveAtLeast16ShadowRaysInEachPixel) {
  Scene scene = scenes::empty(24, {{0, 4, 4}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.lights = {{RectLight{{-2, 3, -2}, {4, 0, 0}, {0, 0, 4}}}};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.8, 0.8}));
  for (const std::uint32_t samples : {1u, 4u, 16u, 64u}) {
    scene.accuracy.samples = samples;
    const double rays = static_cast<double>(scenes::render(scene).statistics.rays.shadow) / (24 * 24);
    EXPECT_NEAR(rays, std::max(16u, samples), 1) << samples;
  }
}

constexpr double lamp_height = 100, edge_height = 1, reach = 5;  // the lamp spans 2 reach across the edge

/// A strip of floor across the shadow of a straight edge over x = 0, seen from under the sheet that casts it.
Scene strip(const LightSource& lamp) {
  Scene scene = scenes::empty(1, scenes::orthographic({0, 0.5, 0}, {0, 0, 0}, 0.004, {0, 0, -1}));
  scene.image = {64, 1};
  scene.accuracy.samples = 1024;
  scene.lights = {{lamp}};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  const double h = edge_height;
  scenes::add(scene, scenes::quad({-900, h, -900}, {0, h, -900}, {0, h, 900}, {-900, h, 900}),
              scenes::matte({1, 1, 1}));
  return scene;
}

/// `part` is that of the lamp on one side of a line at x reaches from its middle, from 0 at x = -1 to 1 at x = 1.
void expect_penumbra(const LightSource& lamp, const std::function<double(double)>& part) {
  Scene scene = strip(lamp);
  const auto shadowed = scenes::render(scene, 2).image;
  scene.lights[0].shadows = false;
  const auto open = scenes::render(scene, 2).image;
  for (std::uint32_t i = 0; i < 64; ++i) {
    // From floor point f the edge hides what of the lamp lies at x < -f (H - h) / h.
    const double f = (i - 31.5) * 0.004, half_pixel = 0.5;
    const auto seen = [&](double pixel) {
      const double x = (f + pixel * 0.004) * (lamp_height - edge_height) / (edge_height * reach);
      return part(std::clamp(x, -1.0, 1.0));
    };
    const double light = shadowed.pixel(i, 0)[0] / open.pixel(i, 0)[0];
    const double expected = (seen(-half_pixel) + 4 * seen(0) + seen(half_pixel)) / 6;
    if (seen(half_pixel) == 0) {
      EXPECT_EQ(light, 0) << "umbra, pixel " << i;
    } else if (seen(-half_pixel) == 1) {
      EXPECT_EQ(light, 1) << "open, pixel " << i;
    } else {
      EXPECT_NEAR(light, expected, 0.01) << "pixel " << i;
    }
  }
}

TEST(Penumbra, OfALineARectAndASphereIsLinearInItsWidth) {
  const auto evenly = [](double x) { return (1 + x) / 2; };
  expect_penumbra(LineLight{{-reach, lamp_height, 0}, {reach, lamp_height, 0}}, evenly);
  expect_penumbra(RectLight{{-reach, lamp_height, -3}, {2 * reach, 0, 0}, {0, 0, 6}}, evenly);
  // a sphere's zones are as their heights (Archimedes)
  expect_penumbra(SphereLight{{0, lamp_height, 0}, reach}, evenly);
}

TEST(Penumbra, OfADiscGrowsAsTheAreaOfItsSegment) {
  expect_penumbra(DiscLight{{0, lamp_height, 0}, {0, -1, 0}, reach}, [](double x) {
    return std::abs(x) == 1 ? (1 + x) / 2 : 0.5 + (x * std::sqrt(1 - x * x) + std::asin(x)) / std::numbers::pi;
  });
}

}  // namespace
