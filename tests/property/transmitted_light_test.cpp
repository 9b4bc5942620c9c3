/// Lights that brighten a surface from behind: Hall's diffuse and specular transmission.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/src/math/vec.h"

using namespace tracer;

namespace {

Material leaf(double reflected, double transmitted) {
  Material material = scenes::matte({1, 1, 1});
  material.diffuse = reflected;
  material.diffuse_transmission = transmitted;
  return material;
}

enum class Kind { flat, smooth, gouraud, flat_polygon, bump, textured, instance };

/// One triangle with vertex normals, lit along `direction`.
Scene lit_triangle(Kind kind, const Vec3& direction, double reflected, double transmitted) {
  Scene scene = scenes::empty(32, {{0, 0.2, 4}, {0, 0, 0}, {0, 1, 0}, 35});
  Material material = leaf(reflected, transmitted);
  scene.textures = {{NoiseTexture{{Color{0, 0, 0}, Color{1, 1, 1}}, 2}, {3, 3}, {}, "/textures/t"}};
  if (kind == Kind::flat) material.shading = Material::Shading::flat;
  if (kind == Kind::gouraud) material.shading = Material::Shading::gouraud;
  if (kind == Kind::flat_polygon) material.shading = Material::Shading::flat_polygon;
  if (kind == Kind::bump) material.bump = Bump{TextureId{0}, 0.2};
  if (kind == Kind::textured) material.color = material.diffuse_transmission_color = TextureId{0};
  const MaterialId id = scenes::add(scene, material);
  const Triangle triangle{
      {Vec3{-1, -1, 0}, {1.2, -0.8, 0.1}, {0.1, 1.1, -0.1}}, {{Vec3{-0.9, -0.3, 1}, {0.9, -0.2, 1}, {0, 0.7, 1}}}, {}};
  if (kind == Kind::instance) {
    scene.prototypes.push_back({.objects = {{.shape = triangle, .material = id}}, .path = "/prototypes/p"});
    scenes::add(scene, Instance{PrototypeId{0}, {}}, id);
    scene.objects.back().transform = Transform{{{{0.8, 0.2, 0, 0.1}, {-0.2, 1.1, 0.1, 0}, {0, 0, 1.3, -0.2}}}};
  } else {
    scenes::add(scene, triangle, id);
  }
  scene.lights = {scenes::directional_light(direction, {1, 0.75, 0.5})};
  return scene;
}

/// The same surface under the opposite light.
TEST(TransmittedLight, EqualsTheReflectedLightOfTheOppositeSideBitForBit) {
  for (const Kind kind :
       {Kind::flat, Kind::smooth, Kind::gouraud, Kind::flat_polygon, Kind::bump, Kind::textured, Kind::instance})
    for (const Vec3& direction : {Vec3{0.2, -0.4, -1}, Vec3{1, 0.1, -0.5}}) {
      const Rendered front = scenes::render(lit_triangle(kind, direction, 0.7, 0));
      const Rendered behind = scenes::render(lit_triangle(kind, -direction, 0, 0.7));
      EXPECT_EQ(front.image.rgb, behind.image.rgb) << static_cast<int>(kind);
      EXPECT_GT(*std::max_element(front.image.rgb.begin(), front.image.rgb.end()), 0.2F);
    }
}

TEST(TransmittedLight, AddsNothingWhereTheLightIsInFront) {
  const Vec3 direction{0, 0, -1};  // all vertex normals are on its side
  for (const Kind kind : {Kind::flat, Kind::smooth, Kind::gouraud, Kind::textured})
    EXPECT_EQ(scenes::render(lit_triangle(kind, direction, 0.7, 0.9)).image.rgb,
              scenes::render(lit_triangle(kind, direction, 0.7, 0)).image.rgb);
}

/// The front wall shows the light that came through the back wall and the inside; through the front wall one sees the
/// back wall, which shows the light that comes through it.
TEST(TransmittedLight, OfASolidPassesItsOtherWallAndItsInside) {
  Scene scene = scenes::empty(1, scenes::orthographic({0, 0, 5}, {0, 0, 0}, 1e-6));
  scene.accuracy.max_depth = 4;
  Material slab = leaf(0, 0.5);
  slab.transmission = 0.8;
  slab.transmission_color = Color{1, 0.5, 0.25};
  slab.transparency = Material::Transparency::filtered;
  slab.absorption = {0.3, 0, 1};
  scenes::add(scene, Box{{-1, -1, -2}, {1, 1, 0}}, slab);
  scene.lights = {scenes::directional_light({0, 0, 1})};
  const std::vector<float> rgb = scenes::render(scene).image.rgb;
  const auto expected = [](double color, double absorption) {
    return 2 * 0.5 * (0.8 * color) * std::exp(-absorption * 2);
  };
  EXPECT_NEAR(rgb[0], expected(1, 0.3), 1e-7);
  EXPECT_NEAR(rgb[1], expected(0.5, 0), 1e-7);
  EXPECT_NEAR(rgb[2], expected(0.25, 1), 1e-7);
}

}  // namespace
