/// Materials whose surface is partly missing.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/encode.h"

using namespace tracer;

namespace {

/// A floor under a lamp, seen past and through a pane that shades it.
Scene pane_over_floor(const ColorOrTexture& opacity) {
  Scene scene = scenes::empty(40, {{0, 5, 4}, {0, 0, 0}, {0, 1, 0}, 45});
  scene.background.color = {0.2, 0.4, 0.6};
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights = {scenes::point_light({1, 9, 2}), scenes::directional_light({-1, -3, 0.5}, {0.4, 0.4, 0.4})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.7, 0.6}));
  Material pane = scenes::matte({0.3, 0.5, 0.2});
  pane.model = Material::Model::phong;
  pane.specular = 0.5;
  pane.reflection = 0.25;
  pane.emission = Color{0.05, 0, 0};
  pane.opacity = opacity;
  const MaterialId same = scenes::add(scene, pane);
  scenes::add(scene, Triangle{{{{-2, 1, 1.5}, {2, 1, 1.5}, {0, 1.2, -2}}}, {}, {}}, same);
  scenes::add(scene, Sphere{{2.2, 0.6, 0.5}, 0.6}, same);
  scene.accuracy.max_depth = 6;
  return scene;
}

TEST(CutOuts, OfATextureOfOneShareEqualThatShareBitForBit) {
  for (const Color& share : {Color{1, 1, 1}, Color{0.75, 0.5, 0.25}}) {
    Scene textured = pane_over_floor(TextureId{0});
    textured.textures = {{CheckerTexture{{share, share}}, {3, 3}, {}, "/textures/t"}};
    EXPECT_EQ(scenes::render(textured).image.rgb, scenes::render(pane_over_floor(share)).image.rgb);
  }
}

TEST(CutOuts, WithNothingThereLeaveTheSceneBehind) {
  Scene behind = pane_over_floor(Color{1, 1, 1});
  behind.objects.resize(1);
  const std::vector<float> expected = scenes::render(behind).image.rgb;
  const std::vector<float> seen = scenes::render(pane_over_floor(Color{})).image.rgb;
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(seen[i], expected[i], 1e-6) << i;
}

/// A ball rendered with alpha is a cut-out that shows the ball and nothing around it.
TEST(CutOuts, FollowTheAlphaOfAPng) {
  Scene ball = scenes::empty(32, {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 45});
  ball.output.alpha = true;
  scenes::add(ball, Sphere{{0, 0, 0}, 1}, scenes::glowing({1, 1, 1}));
  const Rendered sprite = scenes::render(ball);
  const auto png = encode(sprite.image, Format::png, ball.output);
  ASSERT_TRUE(png);

  Scene scene = scenes::empty(32, ball.camera);
  scene.background.color = {0, 0, 1};
  scene.assets = {{"ball.png", "/textures/t/file"}};
  const ImageTexture alpha{AssetId{0}, {}, ImageTexture::Channel::alpha};
  const double scale = 1 / (2 * 5 * std::tan(std::numbers::pi / 8));
  scene.textures = {{alpha, {scale, scale}, {0.5, 0.5}, "/textures/t", Texture::Wrap::clamp, Texture::Filter::nearest}};
  Material material = scenes::glowing({1, 0, 0});
  material.opacity = TextureId{0};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, Vec3{1, 0, 0}}, material);
  const Rendered seen = scenes::render(scene, 1, {{png->bytes}});
  std::size_t inside = 0;
  for (std::uint32_t y = 0; y < 32; ++y)
    for (std::uint32_t x = 0; x < 32; ++x) {
      const float there = sprite.image.alpha[y * 32 + x];
      const float* const pixel = seen.image.pixel(x, y);
      EXPECT_EQ(pixel[0], there) << x << " " << y;
      EXPECT_EQ(pixel[2], 1 - there);
      inside += there > 0 ? 1 : 0;
    }
  EXPECT_GT(inside, 100U);
}

}  // namespace
