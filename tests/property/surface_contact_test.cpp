// Rays that leave a surface do not meet it again, and rays inside a closed one do not get out.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;

/// Pixels that differ between the scene with shadows and the same without.
std::uint64_t shadowed(Scene scene, std::uint64_t& lit) {
  const auto with = scenes::render(scene, 2).image.rgb;
  for (Light& light : scene.lights) light.shadows = false;
  const auto without = scenes::render(scene, 2).image.rgb;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < with.size(); i += 3) {
    lit += without[i] > 0 ? 1 : 0;
    count += with[i] != without[i] ? 1 : 0;
  }
  return count;
}

/// A view from outside of something about as large as `size` around `center`, lit from outside.
Scene view(const Vec3& center, double size, const Vec3& from) {
  Scene scene = scenes::empty(effort::cases(100) < 100 ? 64 : 256);
  const auto at = [&](const Vec3& v) {
    return Vec3{center.x + v.x * size, center.y + v.y * size, center.z + v.z * size};
  };
  scene.camera = {at({1, 2, 3}), center, {0, 1, 0}, 34};
  scene.lights = {scenes::point_light(at(from)), scenes::directional_light({-from.x, -from.y, -from.z})};
  return scene;
}

TEST(SelfHits, AreNoneOnASphereOfAnySizeAndPlace) {
  std::uint64_t dark = 0, lit = 0;
  for (double radius = 1e-9; radius < 2e9; radius *= 1e3)
    for (const double offset : {0.0, 1.0, 1e3, 1e6})
      for (const Vec3& from : {Vec3{3, 3, 3}, Vec3{-30, 2, 0}, Vec3{1.01, 0, 0}}) {
        const Vec3 center{offset * radius, -offset * radius, 0.7 * offset * radius};
        Scene scene = view(center, radius, from);
        scenes::add(scene, Sphere{center, radius}, scenes::matte({1, 1, 1}));
        dark += shadowed(scene, lit);
      }
  EXPECT_EQ(dark, 0u) << "dark pixels of " << lit;
}

TEST(SelfHits, AreNoneOnASphereThatIsSmallOrLargeInItsScene) {
  std::uint64_t dark = 0, lit = 0;
  for (double radius = 1e-8; radius < 1e9; radius *= 10) {
    Scene scene = view({0.3, 0.2, 0.1}, radius, {3, 3, 3});
    scenes::add(scene, Sphere{{0.3, 0.2, 0.1}, radius}, scenes::matte({1, 1, 1}));
    // Far behind the camera, where they neither are seen nor cast shadows: they hold the frame at some 2000 units.
    for (const double x : {-1e3, 1e3})
      scenes::add(scene, Sphere{{x * std::max(1.0, radius), -1e3, 1e3 * std::max(1.0, radius)}, 1}, MaterialId{0});
    scene.lights.pop_back();
    dark += shadowed(scene, lit);
  }
  EXPECT_EQ(dark, 0u) << "dark pixels of " << lit;
}

TEST(SelfHits, AreNoneOnConvexMeshesFlatOrSmooth) {
  std::uint64_t dark = 0, lit = 0;
  for (const int level : {0, 1, 3, 5})
    for (const double size : {1e-6, 1.0, 1e6}) {
      Scene scene = view({0, 0, 0}, size, {3.1, 3.2, 2.9});
      scenes::add(scene, scenes::placed(scenes::icosphere(level), size, {0, 0, 0}), scenes::matte({1, 1, 1}));
      dark += shadowed(scene, lit);
    }
  EXPECT_EQ(dark, 0u) << "dark pixels of " << lit;
}

TEST(SelfHits, AreNoneOnPlanesSeenAtAnyAngleFromAnyHeight) {
  std::uint64_t dark = 0, lit = 0;
  for (double height = 1e-9; height < 2e9; height *= 1e3)
    for (const double tilt : {0.0, 0.3, 10.0}) {
      Scene scene = scenes::empty(128);
      scene.camera = {{0, height, 0}, {height, height * 0.9, 0.1 * height}, {0, 1, 0}, 90};
      scene.lights = {scenes::point_light({2 * height, 0.5 * height, height}),
                      scenes::directional_light({-1, -0.01, 0})};
      scenes::add(scene, Plane{{0, 0, 0}, {0, 1, tilt * 1e-3}, {}}, scenes::matte({1, 1, 1}));
      dark += shadowed(scene, lit);
    }
  EXPECT_EQ(dark, 0u) << "dark pixels of " << lit;
}

TEST(SelfHits, AreNoneInsideAConvexRoomLitFromInside) {
  std::uint64_t dark = 0, lit = 0;
  for (const double size : {1e-6, 1.0, 1e6})
    for (const bool sphere : {true, false}) {
      Scene scene = scenes::empty(256);
      scene.camera = {{0.1 * size, 0, 0}, {0, 0.2 * size, -size}, {0, 1, 0}, 130};
      scene.lights = {scenes::point_light({0.3 * size, 0.4 * size, 0.2 * size})};
      if (sphere) {
        scenes::add(scene, Sphere{{0, 0, 0}, size}, scenes::matte({1, 1, 1}));
      } else {
        scenes::add(scene, scenes::placed(scenes::icosphere(3), size, {0, 0, 0}), scenes::matte({1, 1, 1}));
      }
      dark += shadowed(scene, lit);
    }
  EXPECT_EQ(dark, 0u) << "dark pixels of " << lit;
}

// ---- leaks ---------------------------------------------------------------------------------------------------------

TEST(Leaks, AreNoneInAMillionRaysFromInsideClosedMeshes) {
  std::uint64_t leaked = 0, rays = 0;
  for (const int shape : {0, 1, 2})
    for (const Vec3& towards :
         {Vec3{1, 0, 0}, Vec3{-1, 0.1, 0}, Vec3{0, 1, 0.2}, Vec3{0.1, -1, 0}, Vec3{0, 0.1, 1}, Vec3{0.1, 0, -1}}) {
      Scene scene = scenes::empty(effort::cases(100) < 100 ? 60 : 250);
      scene.background.color = {1, 1, 1};
      const Mesh mesh = shape == 0 ? scenes::icosphere(1) : shape == 1 ? scenes::icosphere(6) : scenes::torus(300, 100);
      const Vec3 eye = shape == 2 ? Vec3{1.02, 0.03, 0.1} : Vec3{0.1, 0.05, -0.2};
      scene.camera = {eye, {eye.x + towards.x, eye.y + towards.y, eye.z + towards.z}, {0.3, 1, 0.9}, 100};
      scenes::add(scene, mesh, scenes::glowing({0, 0, 0}));
      const Image image = scenes::render(scene, 2).image;
      rays += image.rgb.size() / 3;
      for (std::size_t i = 0; i < image.rgb.size(); i += 3) leaked += image.rgb[i] > 0 ? 1 : 0;
    }
  EXPECT_EQ(leaked, 0u) << "of " << rays;
  if (effort::cases(100) >= 100) {
    EXPECT_GT(rays, 1'000'000u);
  }
}

}  // namespace
