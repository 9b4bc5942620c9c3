// Analytic shadows, mirror images, and thousands of lights with culled shadow rays.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/effort.h"
#include "tests/support/pixel_ray.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace {

using oracle::Real;
using oracle::Vec;
using namespace tracer;

TEST(Shadow, OfASphereOnAPlaneCoversExactlyThePixelsThatTheSphereHidesFromTheLight) {
  std::uint64_t wrong = 0, dark = 0, lit = 0;
  for (const double radius : {0.01, 0.3, 1.0, 1.9})
    for (const Vec3& light : {Vec3{1, 5, 2}, Vec3{-8, 2.5, 0}, Vec3{0, 4.0001, 0}}) {
      Scene scene = scenes::empty(effort::cases(100) < 100 ? 64 : 256);
      scene.camera = {{0.5, 30, 0.2}, {0, 0, 0}, {0, 0, -1}, 50};
      scene.lights = {scenes::point_light(light)};
      scenes::add(scene, Sphere{{0, 2, 0}, radius}, scenes::matte({1, 1, 1}));
      scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
      const Image image = scenes::render(scene).image;
      const Vec eye = scene.camera.position, center(0, 2, 0);
      for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
          const Vec d = oracle::through(scene, x, y);
          const Real seen = length(cross(d, center - eye));  // the line of sight's distance from the sphere's centre
          if (seen < radius * (1 + 1e-9)) continue;
          const Vec floor = eye + (-eye.y / d.y) * d, l = unit(Vec(light) - floor);
          const Real distance = length(cross(l, center - floor));
          if (std::fabs(distance - radius) < 1e-12L) continue;  // the edge itself
          const bool hidden = distance < radius;
          ++(hidden ? dark : lit);
          wrong += (image.pixel(x, y)[0] == 0) != hidden ? 1 : 0;
        }
    }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(dark, 1000u);
  EXPECT_GT(lit, dark);
}

TEST(PlaneMirror, GivesTheMirroredImageOfACameraBehindIt) {
  for (std::uint64_t seed = 1; seed <= effort::cases(20); ++seed) {
    // Spheres and lamps before the mirror x = 0, and nothing whose own rays the mirror would catch.
    Scene behind = scenes::random(seed, 40);
    std::erase_if(behind.objects, [](const Object& o) { return std::holds_alternative<Plane>(o.shape); });
    for (Object& object : behind.objects) std::get<Sphere>(object.shape).center.x += 20;
    for (Material& material : behind.materials) material.reflection = material.transmission = 0;
    for (Light& light : behind.lights) light.source = PointLight{{12 + static_cast<double>(seed), 9, -3}};
    behind.camera = {{-10, 0.3, 0.2}, {20, 0, 0}, {0, 1, 0}, 20};
    behind.accuracy.max_depth = 6;
    Scene mirrored = behind;
    mirrored.camera.position.x = 10;
    mirrored.camera.look_at.x = -20;
    mirrored.accuracy.max_depth = 7;
    scenes::add(mirrored, Plane{{0, 0, 0}, {1, 0, 0}, {}}, scenes::mirror());
    const Image expected = scenes::render(behind).image, image = scenes::render(mirrored).image;
    std::uint64_t different = 0;
    for (std::uint32_t y = 0; y < 40; ++y)
      for (std::uint32_t x = 0; x < 40; ++x)
        for (int c = 0; c < 3; ++c) {
          const float a = image.pixel(x, y)[c], b = expected.pixel(39 - x, y)[c];
          different += std::fabs(a - b) > 1e-6F * b + 1e-9F ? 1 : 0;
        }
    EXPECT_EQ(different, 0u) << "seed " << seed;
  }
}

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
