// Depth maps instead of shadow rays: exact up to the last texel before an edge, for every type and place of a light.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/support/long_vec.h"
#include "tests/support/scenes.h"
#include "tracer/src/math/vec.h"

namespace {

using oracle::Real;
using oracle::Vec;
using namespace tracer;

Rendered mapped(Scene scene, std::uint32_t threads = 1) {
  scene.accuracy.approximate.shadows = Approximations::Shadows::map;
  return scenes::render(scene, threads);
}

const Vec ball{0, 1.5L, 0};
constexpr std::uint32_t side = 192;

/// A ball over a floor, seen from above.
Scene ball_over_floor(const Light& light) {
  Scene scene = scenes::empty(side, {{0, 12, 5}, {0, 0, 0}, {0, 1, 0}, 50});
  scene.lights = {light};
  scenes::add(scene, Sphere{{0, 1.5, 0}, 1}, scenes::matte({1, 1, 1}));
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  return scene;
}

Real distance_from_line(const Vec& point, const Vec& on_line, const Vec& direction) {
  const Vec offset = point - on_line;
  return length(offset - dot(offset, direction) * direction);
}

/// Unit direction from a place towards the only light.
Vec towards_light(const Scene& scene, const Vec& place) {
  const LightSource& source = scene.lights[0].source;
  if (const auto* sun = std::get_if<DirectionalLight>(&source)) return unit(-Vec(sun->direction));
  return unit(Vec(std::get<PointLight>(source).position) - place);
}

/// Compares the map's shadow of the ball on the floor with the exact one. They may differ no farther from the edge than
/// half the diagonal of a texel, measured where the light passes the ball.
void expect_exact_up_to(Real texel, const Scene& scene) {
  const Rendered exact = scenes::render(scene);
  const Rendered seen = scenes::approximated(scene, {.shadows = Approximations::Shadows::map});
  EXPECT_GT(exact.statistics.rays.shadow, 0u);
  EXPECT_EQ(seen.statistics.rays.shadow, 0u);
  const Vec eye = scene.camera.position;
  int dark = 0, wrong = 0, wrong_elsewhere = 0;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const Vec direction = oracle::through(scene, x, y);
      if (distance_from_line(ball, eye, direction) <= 1) continue;  // on the ball
      const Vec place = eye + (-eye.y / direction.y) * direction;
      const Real from_axis = distance_from_line(ball, place, towards_light(scene, place));
      const bool lit = *exact.image.pixel(x, y) > 0;
      EXPECT_TRUE(lit == (from_axis > 1) || std::abs(from_axis - 1) < 1e-9L);
      dark += lit ? 0 : 1;
      if (*seen.image.pixel(x, y) == *exact.image.pixel(x, y)) continue;
      ++wrong;
      if (std::abs(from_axis - 1) > 0.71L * texel) ++wrong_elsewhere;
    }
  EXPECT_GT(dark, 200);
  EXPECT_LT(wrong, dark / 4);
  EXPECT_EQ(wrong_elsewhere, 0) << "of " << wrong;
}

TEST(ShadowMap, OfALightOutsideIsExactUpToOneTexel) {
  // The window holds the ball's bounding box, whose corners are sqrt(3) from its middle; 4 texels for each pixel.
  const Real distance = length(Vec(3, 8, 2) - ball), tangent = std::sqrt(3 / (distance * distance - 3));
  expect_exact_up_to(2 * tangent * (distance + 1) / (2 * side), ball_over_floor(scenes::point_light({3, 8, 2})));
}

TEST(ShadowMap, OfALightInsideTheSceneCoversAllDirections) {
  Scene scene = ball_over_floor(scenes::point_light({3, 8, 2}));
  for (const double z : {-30.0, 30.0}) scenes::add(scene, Sphere{{0, 1, z}, 1}, scenes::matte({1, 1, 1}));
  const Real texels = std::floor(std::sqrt(4.0L * side * side / 6));
  expect_exact_up_to(2 * (length(Vec(3, 8, 2) - ball) + 1) / texels, scene);
}

TEST(ShadowMap, OfADirectionalOrVeryDistantLightHasParallelRays) {
  for (const Light& light : {scenes::directional_light({-1, -2, 0.5}), scenes::point_light({3e9, 8e9, 2e9})})
    expect_exact_up_to(2 * std::sqrt(3.0L) / (2 * side), ball_over_floor(light));
}

TEST(ShadowMap, OfAnAreaLightIsThatOfItsCenter) {
  const Scene blurred = ball_over_floor({DiscLight{{3, 8, 2}, {0, -1, 0}, 0.5}}),
              sharp = ball_over_floor(scenes::point_light({3, 8, 2}));
  const Rendered soft_seen = mapped(blurred), sharp_seen = mapped(sharp);
  int dark = 0;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      if (distance_from_line(ball, Vec(sharp.camera.position), oracle::through(sharp, x, y)) <= 1) continue;
      const bool lit = *sharp_seen.image.pixel(x, y) > 0;
      EXPECT_EQ(*soft_seen.image.pixel(x, y) > 0, lit) << x << " " << y;
      dark += lit ? 0 : 1;
    }
  EXPECT_GT(dark, 200);
}

TEST(ShadowMap, OfASphereLightIgnoresASphereInsideIt) {
  Scene scene = ball_over_floor({SphereLight{{3, 4, 2}, 0.5}});
  const Rendered bare = mapped(scene);
  scenes::add(scene, Sphere{{3, 4, 2}, 0.25}, scenes::glowing({1, 1, 1}));
  const Rendered with_bulb = mapped(scene);
  EXPECT_GT(*bare.image.pixel(8, side - 8), 0);
  EXPECT_EQ(*with_bulb.image.pixel(8, side - 8), *bare.image.pixel(8, side - 8));
}

/// One convex body alone: no part of it is in the way of what faces the light.
TEST(ShadowMap, HasNoSelfShadowing) {
  const std::vector<std::pair<std::string, Shape>> bodies{
      {"sphere", Sphere{{0, 0, 0}, 1}},
      {"box", Box{{-1, -1, -1}, {1, 1, 1}}},
      {"cylinder", Cylinder{{0, -1, 0}, {0, 1, 0}, 0.7, true, {}}},
      {"cone", Cone{{0, 1, 0}, {0, -1, 0}, 1, 0, true, {}}},
      {"facets", scenes::icosphere(3)},
      {"plane", Plane{{0, 0, 0}, {0.1, 1, 0}, {}}},
  };
  for (const auto& [name, body] : bodies)
    for (const Vec3& towards : {Vec3{0.3, 1, 0.2}, Vec3{1, 0.02, 0}, Vec3{-0.5, 0.5, 1}, Vec3{1, 1e-3, 1}})
      for (const double distance : {1.8, 3.0, 50.0, 1e8}) {
        Scene scene = scenes::empty(96, {{1, 1.5, 4}, {0, 0, 0}, {0, 1, 0}, 40});
        scene.lights = {scenes::point_light(towards * distance), scenes::directional_light(-towards)};
        scenes::add(scene, body, scenes::matte({1, 1, 1}));
        EXPECT_EQ(mapped(scene).image.rgb, scenes::render(scene).image.rgb)
            << name << " " << towards.x << " " << distance;
      }
}

TEST(ShadowMap, ContainsPlanesAnywhere) {
  for (const bool lets_light_through : {false, true}) {
    Scene scene = scenes::empty(64, {{0, 12, 5}, {0, 0, 0}, {0, 1, 0}, 100});
    scene.lights = {scenes::directional_light({-1, -1, 0}), scenes::point_light({20, 9, 0})};
    scenes::add(scene, Sphere{{0, -3, 0}, 0.5}, scenes::matte({1, 1, 1}));  // below the floor: nothing to see
    scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
    Material wall = scenes::matte({1, 1, 1});
    wall.transmission = lets_light_through ? 1 : 0;
    wall.transparency = Material::Transparency::filtered;
    scenes::add(scene, Plane{{9, 0, 0}, {1, 0.2, 0}, {}}, wall);
    EXPECT_EQ(mapped(scene).image.rgb, scenes::render(scene).image.rgb);
    EXPECT_EQ(*mapped(scene).image.pixel(8, 48) > 0, lets_light_through);
  }
}

TEST(ShadowMap, OmitsTransmissiveSurfaces) {
  Scene scene = ball_over_floor(scenes::point_light({3, 8, 2}));
  scene.materials[0].transmission = 0.5;
  scene.materials[0].transparency = Material::Transparency::filtered;
  scene.accuracy.approximate.shadows = Approximations::Shadows::none;
  EXPECT_EQ(mapped(scene).image.rgb, scenes::render(scene).image.rgb);
}

TEST(ShadowMap, CountsAsMemoryOfTheCompiledScene) {
  Scene scene = ball_over_floor(scenes::point_light({3, 8, 2}));
  const std::uint64_t without = memory_bytes(*scenes::compiled(scene));
  scene.accuracy.approximate.shadows = Approximations::Shadows::map;
  EXPECT_EQ(memory_bytes(*scenes::compiled(scene)) - without, 4 * (2 * side) * (2 * side));
}

TEST(ShadowMap, IsBitIdenticalForAnyNumberOfThreads) {
  const Scene scene = ball_over_floor(scenes::point_light({3, 8, 2}));
  EXPECT_EQ(mapped(scene, 1).image.rgb, mapped(scene, 3).image.rgb);
}

TEST(ShadowMap, OfACropEqualsThatOfTheFullImage) {
  Scene scene = ball_over_floor(scenes::point_light({3, 8, 2}));
  const Rendered whole = mapped(scene);
  scene.image.crop = PixelWindow{60, 70, 120, 100};
  const Rendered part = mapped(scene);
  for (std::uint32_t y = 0; y < 30; ++y)
    for (std::uint32_t x = 0; x < 60; ++x) EXPECT_EQ(*part.image.pixel(x, y), *whole.image.pixel(60 + x, 70 + y));
}

}  // namespace
