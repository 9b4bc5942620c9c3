// Environments and cube maps, rendered through the public interface: directly and in mirrors.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace tracer;

Texture imaged(Texture::Filter filter) {
  return {.pattern = ImageTexture{}, .path = "/background/environment", .filter = filter};
}

/// An empty scene seen by a panorama camera.
Scene panorama(const Vec3& up, const Vec3& ahead) {
  Scene scene = scenes::empty(64, {.position = {1, 2, 3}, .look_at = Vec3{1, 2, 3} + ahead, .up = up});
  scene.image = {128, 64, {}};
  scene.camera.type = Camera::Type::panorama;
  scene.background.up = up;
  return scene;
}

TEST(Environment, ReproducesItsPanoramaBitForBit) {
  for (const auto& [up, ahead] : {std::pair{Vec3{0, 1, 0}, Vec3{0, 0, -1}}, {Vec3{0, 0, 2}, Vec3{1, 0, 0}}}) {
    Scene world = panorama(up, ahead);
    world.background.gradient = Gradient{{0.2, 0.4, 1}, {1, 0.5, 0}};
    world.lights.push_back(scenes::point_light({3, 9, 5}));
    for (const Vec3& center : {Vec3{6, 2, 1}, {-3, 7, 2}, {1, -2, 9}, {2, 4, -4}})
      scenes::add(world, Sphere{center, 1.5}, scenes::matte({0.1 * center.y + 0.5, 0.5, 0.2}));
    const Image seen = scenes::render(world).image;
    const auto file = encode(seen, Format::exr);
    ASSERT_TRUE(file);
    for (const auto filter : {Texture::Filter::nearest, Texture::Filter::bilinear, Texture::Filter::mipmap}) {
      Scene again = panorama(up, ahead);
      again.textures = {imaged(filter)};
      again.assets = {{"world.exr", "/background/environment/file"}};
      again.background.environment = Environment{};
      const Image back = scenes::render(again, 1, {{file->bytes}}).image;
      if (filter == Texture::Filter::nearest) {
        EXPECT_EQ(back.rgb, seen.rgb);
      } else if (filter == Texture::Filter::bilinear) {
        for (std::size_t i = 0; i < seen.rgb.size(); ++i) ASSERT_NEAR(back.rgb[i], seen.rgb[i], 1e-5) << i;
      }
      double difference = 0;  // mipmap mixes with its neighbours towards the poles
      for (std::size_t i = 0; i < seen.rgb.size(); ++i) difference += std::abs(back.rgb[i] - seen.rgb[i]);
      EXPECT_LT(difference / static_cast<double>(seen.rgb.size()), 0.01);
    }
  }
}

TEST(Environment, OfOneColourIsTheConstantBackground) {
  Scene scene = scenes::random(3, 32);
  const Color color{0.5, 0.25, 2};
  scene.background = {.color = color};
  const Rendered plain = scenes::render(scene);
  scene.textures.push_back({.pattern = CheckerTexture{{color, color}}, .path = {}, .filter = Texture::Filter::nearest});
  const TextureId last{static_cast<std::uint32_t>(scene.textures.size() - 1)};
  scene.background.environment = Environment{last, 12};
  EXPECT_EQ(scenes::render(scene).image.rgb, plain.image.rgb);
  scene.background.environment.reset();
  scene.background.cube = CubeMap{{last, last, last, last, last, last}};
  const Rendered cube = scenes::render(scene);
  EXPECT_EQ(cube.image.rgb, plain.image.rgb);
  EXPECT_EQ(cube.statistics.rays.reflection, plain.statistics.rays.reflection);
  EXPECT_EQ(cube.statistics.rays.shadow, plain.statistics.rays.shadow);
}

/// At the image position of a mirror ball's normal n, an orthographic camera sees the direction d - 2 (d.n) n.
TEST(Environment, IsReflectedByASphereInTheReflectedDirection) {
  Scene scene = scenes::empty(65, scenes::orthographic({0, 0, 5}, {}, 2));
  scene.textures = {{.pattern = GradientTexture{{Color{1, 0, 0}, Color{0, 0, 1}}}, .path = {}}};
  scene.textures[0].filter = Texture::Filter::nearest;
  scene.background.environment = Environment{};
  scenes::add(scene, Sphere{{}, 1}, scenes::mirror());
  const Image image = scenes::render(scene).image;
  for (std::uint32_t y = 0; y < 65; ++y)
    for (std::uint32_t x = 0; x < 65; ++x) {
      const double nx = (x + 0.5) * 2 / 65 - 1, ny = 1 - (y + 0.5) * 2 / 65, across = nx * nx + ny * ny;
      if (across > 0.98) continue;
      const double mirrored_up = 2 * std::sqrt(1 - across) * ny;
      EXPECT_NEAR(image.pixel(x, y)[2], 0.5 + std::asin(mirrored_up) / std::numbers::pi, 1e-6) << x << " " << y;
    }
}

TEST(Environment, HasANarrowerFootprintWithMoreSamples) {
  // A checker far finer than a pixel: its mean however many samples, not noise.
  Scene scene = panorama({0, 1, 0}, {0, 0, -1});
  scene.textures = {{.pattern = CheckerTexture{{Color{1, 1, 1}, Color{}}}, .scale = {4096, 2048}, .path = {}}};
  scene.background.environment = Environment{};
  for (const float channel : scenes::render(scene).image.rgb) EXPECT_NEAR(channel, 0.5, 0.02);
  EXPECT_TRUE(requirements(scene).environment && requirements(scene).filtered_textures);
  EXPECT_FALSE(requirements(scene).textures) << "of surfaces";
}

/// A gradient, an environment and a cube, each with another color in every direction.
std::vector<Scene> scenes_of_each_sky() {
  std::vector<Scene> all(3, scenes::empty(9));
  const GradientTexture gradient{{Color{0.1, 0.2, 0.9}, Color{0.9, 0.8, 0.3}}};
  for (Scene& scene : all) scene.textures = std::vector<Texture>(6, Texture{gradient, {1, 1}, {0, 0}, "/textures/a"});
  all[0].background.gradient = Gradient{{0.2, 0.4, 1}, {1, 0.5, 0}};
  all[1].background.environment = Environment{{0}, 30};
  all[2].background.cube = CubeMap{{{{0}, {1}, {2}, {3}, {4}, {5}}}};
  return all;
}

TEST(Background, StaysWhereItIsWhenTheCameraBanks) {
  for (const Vec3& ahead : {Vec3{0, 0.3, -1}, Vec3{2, -0.4, 1}, Vec3{0.1, 1, 0.2}})
    for (Scene level : scenes_of_each_sky()) {
      level.image = {9, 9, {}};
      level.camera = {.position = {1, 2, 3}, .look_at = Vec3{1, 2, 3} + ahead, .fov_deg = 20};
      Scene banked = level;
      const Vec3 right = cross(ahead, level.camera.up);
      banked.camera.up = right + level.camera.up * 0.001;  // by a quarter of a turn
      const Image one = scenes::render(level).image, other = scenes::render(banked).image;
      const auto center_of = [](const Image& image) { return image.pixel(4, 4)[2]; };
      EXPECT_NEAR(center_of(other), center_of(one), 1e-6);
      banked.background.up.reset();
      const Image turned = scenes::render(banked).image;
      banked.background.up = banked.camera.up * 3;
      EXPECT_EQ(scenes::render(banked).image.rgb, turned.rgb) << "the same direction, written out";
      EXPECT_NE(turned.rgb, other.rgb);
    }
}

TEST(Environment, OfAFileThatIsNoImageFailsWithBadAsset) {
  Scene scene = panorama({0, 1, 0}, {0, 0, -1});
  scene.textures = {imaged(Texture::Filter::mipmap)};
  scene.assets = {{"sky.txt", "/background/environment/file"}};
  scene.background.environment = Environment{};
  RenderControl control;
  const auto compiled = compile(scene, control, {{{'s', 'k', 'y'}}});
  ASSERT_FALSE(compiled);
  EXPECT_EQ(compiled.error().code, Failure::Code::bad_asset);
  EXPECT_EQ(compiled.error().pointer, "/background/environment/file");
}

}  // namespace
