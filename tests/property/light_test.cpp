// Analytic shadows, mirror images, and conservation of energy.
#include <gtest/gtest.h>

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

}  // namespace
