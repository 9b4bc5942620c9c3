// Where tracers break: sizes and distances beyond all reason, self-hits, leaks, mirrors without end, light without
// bound.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "tests/support/effort.h"
#include "tests/support/long_vec.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;

/// Two mirrors that face each other, each glowing, and a pixel that looks from one at the other.
Scene corridor(double rho, std::uint32_t depth) {
  Scene scene = scenes::empty(2);
  scene.camera = {{0, 0, 0.25}, {0, 0, 1}, {0, 1, 0}, 1};
  Material wall = scenes::mirror(rho);
  wall.emission = {1, 0.5, 0.25};
  const MaterialId material = scenes::add(scene, wall);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, material);
  scenes::add(scene, Plane{{0, 0, 1}, {0, 0, -1}, {}}, material);
  scene.accuracy.max_depth = depth;
  return scene;
}

TEST(MirrorCorridor, IsTheGeometricSeriesToAnyDepth) {
  for (const double rho : {0.5, 0.9, 0.999, 0.99999})
    for (const std::uint32_t depth : {0u, 1u, 10u, 1000u, 20'000u}) {
      const Rendered rendered = scenes::render(corridor(rho, depth));
      const auto expected = static_cast<double>((1 - std::pow(oracle::Real(rho), depth + 1)) / (1 - oracle::Real(rho)));
      for (int pixel = 0; pixel < 4; ++pixel) {
        ASSERT_NEAR(rendered.image.rgb[3 * pixel], expected, 1e-7 * expected + 1e-11 * depth) << rho << " " << depth;
        ASSERT_NEAR(rendered.image.rgb[3 * pixel + 1], expected / 2, 1e-7 * expected + 1e-11 * depth);
      }
      if (std::pow(rho, depth + 1) > 0) {
        ASSERT_EQ(rendered.statistics.rays.reflection, 4ull * depth);
        ASSERT_EQ(rendered.statistics.truncated_branches, 4u);
      }
    }
}

/// Largest resident memory this process ever had, in bytes.
std::uint64_t peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") {
      std::uint64_t kibibytes = 0;
      status >> kibibytes;
      return kibibytes * 1024;
    }
  return 0;
}

TEST(MirrorCorridor, TakesNoMemoryByItsDepth) {
  scenes::render(corridor(1, 1000));
  const std::uint64_t before = peak_memory();
  const std::uint32_t depth = effort::cases(100) < 100 ? 20'000 : 300'000;
  const Rendered rendered = scenes::render(corridor(1, depth));
  EXPECT_EQ(rendered.statistics.rays.reflection, 4ull * depth);
  EXPECT_FLOAT_EQ(rendered.image.rgb[0], static_cast<float>(depth + 1));
#ifdef WHITTLE_SANITIZED
  const std::uint64_t bound = 512u << 20;  // sanitizers keep what is freed
#else
  const std::uint64_t bound = 1u << 20;
#endif
  EXPECT_LT(peak_memory() - before, bound);
}

// ---- beyond all reason ---------------------------------------------------------------------------------------------

void expect_finite(const Rendered& rendered) {
  EXPECT_EQ(rendered.statistics.non_finite, 0u);
  for (const float value : rendered.image.rgb) ASSERT_TRUE(std::isfinite(value) && value >= 0) << value;
}

TEST(Extremes, OfDistanceEndNoProcessAndGiveFinitePictures) {
  for (double distance = 1e3; distance < 1e60; distance *= 1e4)
    for (const double size : {1.0, 1e-55}) {
      SCOPED_TRACE(distance);
      Scene scene = scenes::empty(3);
      scene.camera = {{0, 0, distance}, {0, 0, 0}, {0, 1, 0}, 10};
      scene.ambient = {1, 1, 1};
      scene.lights = {scenes::directional_light({0, -1, -1}), scenes::point_light({0, 1e60, 0}),
                      scenes::point_light({0, 0, 0})};
      scene.lights[2].attenuation.kind = Attenuation::Kind::inverse_square;
      scene.accuracy.max_depth = 4;
      Material glossy = scenes::glass();
      glossy.diffuse = 1;
      glossy.specular = 1;
      scenes::add(scene, Sphere{{0, 0, 0}, size}, glossy);
      scenes::add(scene, scenes::placed(scenes::icosphere(0), size, {size, 0, 0}), MaterialId{0});
      expect_finite(scenes::render(scene));
      scenes::add(scene, Plane{{0, -distance / 2, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
      scenes::add(scene, Plane{{0, distance, 0}, {0, 1, 1e-9}, {}}, MaterialId{0});
      expect_finite(scenes::render(scene));
      scene.objects.erase(scene.objects.begin(), scene.objects.begin() + 2);  // nothing finite: the world is the frame
      expect_finite(scenes::render(scene));
    }
}

TEST(Extremes, OfPlaceAreFiniteWhereCameraAndLightSitOnInsideAndOneBitOffASurface) {
  for (const double at : {1.0, std::nextafter(1.0, 0), std::nextafter(1.0, 2), 0.0, 0.5})
    for (const double lamp : {1.0, std::nextafter(1.0, 0), std::nextafter(1.0, 2), 0.0, -1.0}) {
      Scene scene = scenes::empty(16);
      scene.camera = {{0, at, 0}, {1, at - 0.1, 0.3}, {0, 1, 0}, 120};
      scene.ambient = {0.1, 0.1, 0.1};
      scene.lights = {scenes::point_light({0, lamp, 0})};
      scene.accuracy.max_depth = 5;
      Material glossy = scenes::glass();
      glossy.diffuse = glossy.specular = 1;
      glossy.model = Material::Model::blinn_phong;
      scenes::add(scene, Sphere{{0, 0, 0}, 1}, glossy);
      scenes::add(scene, Plane{{0, 1, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
      scenes::add(scene, Triangle{{{{-3, 0, -3}, {3, 0, -3}, {0, 0, 3}}}, {}, {}}, glossy);
      expect_finite(scenes::render(scene));
    }
}

TEST(Extremes, OfLightAreTheLargestFloatWhereAFloatCannotHoldThem) {
  Scene scene = scenes::empty(4);
  scene.camera = {{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 5};
  scene.lights = {scenes::point_light({0, 0, 3}, {1e30, 1e30, 1e30})};
  scene.lights[0].intensity = 1e30;
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::matte({1, 1, 1}));
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.non_finite, 0u) << "1e60 is a number";
  for (const float value : rendered.image.rgb) EXPECT_EQ(value, std::numeric_limits<float>::max());
}

TEST(NonFiniteSamples, AreCountedAndLeftOutOfTheMeanOfTheirPixel) {
  // Mirrors that give back 1e30 of what they receive: infinite after eleven bounces. A glowing sheet hides the left
  // half of them, and of the middle pixel.
  Scene scene = corridor(1, 20);
  scene.image = {7, 1};
  scene.camera.fov_deg = 1e-3;
  scene.accuracy.samples = 64;
  scene.materials[0].reflection_color = {1e30, 1e30, 1e30};
  scenes::add(scene, Triangle{{{{0, -1, 0.5}, {0, 1, 0.5}, {2, 0, 0.5}}}, {}, {}}, scenes::glowing({3, 3, 3}));
  const Rendered rendered = scenes::render(scene);
  for (int x = 0; x < 7; ++x)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(rendered.image.rgb[3 * x + c], x <= 3 ? 3 : 0) << "pixel " << x;
  EXPECT_EQ(rendered.statistics.samples, 7u * 64);
  EXPECT_GT(rendered.statistics.non_finite, 3u * 64) << "those of three pixels, and some of the middle one";
  EXPECT_LT(rendered.statistics.non_finite, 4u * 64);
}

TEST(HugeSphere, SeenFromJustAboveIsThePlaneItTouches) {
  Scene ball = scenes::empty(64);
  ball.camera = {{0, 1, 0}, {1, 0.5, 0}, {0, 1, 0}, 60};
  ball.lights = {scenes::point_light({2, 3, 1})};
  Scene flat = ball;
  scenes::add(ball, Sphere{{0, -1e9, 0}, 1e9}, scenes::matte({1, 1, 1}));
  scenes::add(flat, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  const auto a = scenes::render(ball).image, b = scenes::render(flat).image;
  // Below the horizon of both, which the sphere bends by 4e-5.
  std::uint64_t different = 0;
  for (std::uint32_t y = 0; y < 64; ++y)
    for (std::uint32_t x = 0; x < 64; ++x) different += std::fabs(a.pixel(x, y)[0] - b.pixel(x, y)[0]) > 1e-4F ? 1 : 0;
  EXPECT_LE(different, 64u) << "more than the horizon's row";
}

}  // namespace
