// Light of the sky by path tracing, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/global_radiance.h"
#include "tracer/encode.h"

namespace tracer {
namespace {

TEST(GlobalLight, OfTheSkyIsThePartThatIsInSight) {
  constexpr double rho = 0.7, sky = 3;
  for (const bool wall : {false, true}) {
    Scene scene = view_of({0.5, 0, 0}, {3, -3, 3}, 512);
    scene.background.color = {sky, sky, sky};
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(rho));
    if (wall) scenes::add(scene, Plane{{0, 0, 0}, {1, 0, 0}, {}}, surface(0));
    expect_mean(radiance(scene), rho * sky / (wall ? 2 : 1), wall ? "beside a black wall" : "open");
  }
  Scene body = view_of({0, 0, 0}, {3, -3, 3}, 64);
  body.background.color = {sky, sky, sky};
  scenes::add(body, Sphere{{0, 0, 0}, 1}, surface(rho));
  expect_mean(radiance(body), rho * sky, "sphere");
}

TEST(GlobalLight, OfASkyWithASunHasItsIrradianceAndASmallVariance) {
  constexpr std::uint32_t columns = 256, rows = 128, row = 20, column = 40;
  constexpr float sun = 20'000;
  Image sky{columns, rows, {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    const float of_sky = i < columns * rows / 2 ? 1 : 0;
    sky.rgb.insert(sky.rgb.end(), 3, i == row * columns + column ? sun : of_sky);
  }
  const Assets assets{{encode(sky, Format::exr)->bytes}};
  Scene scene = view_of({0, 0, 0}, {0, -8, 1}, 64);
  scene.background.up = {0, 0, 1};
  scene.camera.up = {0, 0, 1};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.8));
  scene.textures.emplace_back().pattern = ImageTexture{};
  scene.textures.back().filter = Texture::Filter::nearest;
  scene.textures.back().path = "/background/environment";
  scene.assets = {{"sky.exr", "/background/environment/file"}};
  scene.background.environment = Environment{};
  const auto squared_sine = [](double v) { return std::pow(std::sin(pi * (0.5 - v / rows)), 2); };
  // Over pi: half of the difference of the squared sines of the latitudes, for the part of a turn.
  const double of_sun = (sun - 1) * (squared_sine(row) - squared_sine(row + 1.0)) / columns;
  const Mean found =
      mean_over_seeds(scene, [&](const Scene& one) { return mean_radiance(scenes::render(one, 1, assets).image); });
  expect_mean(found, 0.8 * (1 + of_sun), "sun");
  EXPECT_GT(of_sun, 1) << "the sun is brighter than the sky";
  EXPECT_LT(found.error * std::sqrt(24 * 4 * 64), 1.5) << "of a sample; hits alone: " << std::sqrt(sun * of_sun);
  for (const auto filter : {Texture::Filter::bilinear, Texture::Filter::mipmap}) {  // both widen the sun
    scene.textures[0].filter = filter;
    const Mean widened =
        mean_over_seeds(scene, [&](const Scene& one) { return mean_radiance(scenes::render(one, 1, assets).image); });
    EXPECT_NEAR(widened.value, found.value, 4 * std::hypot(widened.error, found.error) + 0.002 * found.value);
    EXPECT_LT(widened.error * std::sqrt(24 * 4 * 64), 3);
  }
}

TEST(GlobalLight, IsOneOnAConvexWhiteBodyUnderAWhiteSky) {
  Scene scene = view_of({0, 0, 0}, {3, -3, 3}, 64);
  scene.camera.fov_deg = 30;
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Box{{-1, -1, -1}, {1, 1, 1}}, surface(1));
  const Rendered rendered = scenes::render(scene);
  for (const float value : rendered.image.rgb) EXPECT_NEAR(value, 1, 1e-6);
}

}  // namespace
TEST(GlobalLight, HoldsImageFilesToTheirBrightestTexel) {
  Scene scene = view_of({0, 0, 0}, {0, -8, 1}, 8);
  scene.camera.up = {0, 0, 1};
  Material glazed = surface(1);
  glazed.reflection = 0.25;
  glazed.color = TextureId{0};
  glazed.path = "/materials/glazed";
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, glazed);
  scene.textures.emplace_back().pattern = ImageTexture{};
  scene.assets = {{"tiles.exr", "/textures/tiles/file"}};
  for (const float brightest : {0.7f, 0.8f}) {
    const Image tiles{2, 1, {0.1f, 0.1f, 0.1f, 0.1f, brightest, 0.1f}};
    RenderControl control;
    const auto compiled = compile(scene, control, Assets{{encode(tiles, Format::exr)->bytes}});
    ASSERT_EQ(bool(compiled), brightest < 0.75f);
    if (compiled) continue;
    EXPECT_EQ(compiled.error().code, Failure::Code::bad_asset);
    EXPECT_EQ(compiled.error().pointer, "/materials/glazed");
  }
}

}  // namespace tracer
