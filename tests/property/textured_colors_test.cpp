/// Textures as emission, specular, reflection and transmission colors.

#include <gtest/gtest.h>

#include <array>

#include "tests/support/scenes.h"

using namespace tracer;

namespace {

using Field = ColorOrTexture Material::*;
constexpr std::array<Field, 4> fields{&Material::specular_color, &Material::emission, &Material::reflection_color,
                                      &Material::transmission_color};
constexpr Color tint{0.75, 0.5, 0.25};

/// A ball, a glass pane that shades the floor, and a Gouraud mesh, all with this material.
Scene still_life(const Material& material) {
  Scene scene = scenes::empty(48, {{0, 2.5, 6}, {0, 0.6, 0}, {0, 1, 0}, 45});
  scene.background.color = {0.2, 0.4, 0.6};
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights = {scenes::point_light({2, 6, 3}), scenes::directional_light({-1, -3, 0.5}, {0.4, 0.4, 0.4})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.8, 0.8}));
  const MaterialId same = scenes::add(scene, material);
  scenes::add(scene, Sphere{{-1.2, 0.8, 0}, 0.8}, same);
  scenes::add(scene, Triangle{{{{0.2, 1.5, 1.5}, {2.5, 1.5, 1.5}, {1, 1.5, -0.5}}}, {}, {}}, same);
  Material gouraud = material;
  gouraud.shading = Material::Shading::gouraud;
  scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.5, {1.2, 0.5, 0}), gouraud);
  scene.accuracy.max_depth = 4;
  return scene;
}

Material dielectric(bool fresnel) {
  Material material = scenes::matte({0.4, 0.4, 0.4});
  material.model = Material::Model::blinn_phong;
  material.specular = 0.5;
  material.reflection = fresnel ? 1 : 0.3;
  material.transmission = 0.5;
  material.fresnel = fresnel;
  return material;
}

/// `scene` with a texture of two colors in place of the field of every material that has the tint there.
Scene textured(Scene scene, Field field, const std::array<Color, 2>& colors, Texture::Filter filter) {
  Texture texture{CheckerTexture{colors}, {7, 7}, {}, "/textures/t"};
  texture.filter = filter;
  scene.textures = {texture};
  for (Material& material : scene.materials)
    if (const auto* plain = std::get_if<Color>(&(material.*field)); plain != nullptr && *plain == tint)
      material.*field = TextureId{0};
  return scene;
}

TEST(TexturedColors, OfOneColorEqualThatColorBitForBit) {
  for (const Field field : fields)
    for (const bool fresnel : {false, true})
      for (const std::uint32_t samples : {1u, 4u}) {
        Material material = dielectric(fresnel);
        material.*field = tint;
        Scene plain = still_life(material);
        plain.accuracy.samples = samples;
        const Rendered expected = scenes::render(plain);
        for (const Texture::Filter filter : {Texture::Filter::nearest, Texture::Filter::mipmap}) {
          const Rendered seen = scenes::render(textured(plain, field, {tint, tint}, filter));
          EXPECT_EQ(seen.image.rgb, expected.image.rgb) << fresnel << samples;
          if (filter == Texture::Filter::nearest) {  // the error of filtering is measured by further rays
            EXPECT_EQ(seen.statistics.rays.total(), expected.statistics.rays.total());
          }
        }
      }
}

/// A pane before a light background, all of it within one pixel, with hundreds of squares of the checker.
TEST(TexturedColors, HaveTheMeanOfTheirFootprint) {
  for (const Field field : {&Material::emission, &Material::transmission_color}) {
    Scene scene = scenes::empty(1, {{0, 0, 10}, {0, 0, 0}, {0, 1, 0}, 1});
    scene.background.color = {1, 1, 1};
    Material pane = scenes::matte({0, 0, 0});
    pane.*field = tint;
    if (field == &Material::transmission_color) {
      pane.transmission = 1;
      pane.transparency = Material::Transparency::filtered;
    }
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, pane);
    Scene checkered = textured(scene, field, {Color{}, tint}, Texture::Filter::mipmap);
    checkered.textures[0].scale = {997, 1009};
    const Rendered seen = scenes::render(checkered);
    const std::array<double, 3> expected{tint.r / 2, tint.g / 2, tint.b / 2};
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(seen.image.rgb[c], expected[c], 2e-3);
  }
}

/// The light of a directional lamp through a checkered pane, straight below each square.
TEST(TexturedColors, TintTheLightThatPassesWhereItCrosses) {
  Scene scene = scenes::empty(8, scenes::orthographic({0, 10, 0}, {0, 0, 0}, 8, {0, 0, -1}));
  scene.lights = {scenes::directional_light({0, -1, 0})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  Material pane = scenes::matte({0, 0, 0});
  pane.transmission = 1;
  pane.transparency = Material::Transparency::filtered;
  pane.transmission_color = tint;
  scenes::add(scene, Plane{{0, 20, 0}, {0, 1, 0}, Vec3{1, 0, 0}}, pane);  // above the camera
  const Color other{0, 1, 0.5};
  Scene checkered = textured(scene, &Material::transmission_color, {tint, other}, Texture::Filter::mipmap);
  checkered.textures[0].scale = {1, 1};
  const Rendered seen = scenes::render(checkered);
  const auto color_at = [&](std::uint32_t x, std::uint32_t y) {
    const float* const pixel = seen.image.pixel(x, y);
    return Color{pixel[0], pixel[1], pixel[2]};
  };
  const std::uint32_t first = color_at(0, 0) == tint ? 0 : 1;  // by the direction of v
  for (std::uint32_t y = 0; y < 8; ++y)
    for (std::uint32_t x = 0; x < 8; ++x)
      EXPECT_EQ(color_at(x, y), (x + y) % 2 == first ? tint : other) << x << " " << y;
}

}  // namespace
