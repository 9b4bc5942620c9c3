// Thousands of lights with culled shadow rays.
#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;

/// A floor under lamps that fade with the square of their distance, balls on it, a mirror to see it twice.
Scene hall(std::size_t lamps, double cutoff) {
  Scene scene = scenes::empty(24);
  scene.camera = {{0, 6, 14}, {0, 0, 0}, {0, 1, 0}, 60};
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
  EXPECT_EQ(some.statistics.rays.shadow + some.statistics.culled_shadow_rays, all.statistics.rays.shadow);
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

}  // namespace
