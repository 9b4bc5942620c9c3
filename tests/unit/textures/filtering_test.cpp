// Filtered textures compared with the mean of many samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/support/scenes.h"
#include "tracer/compare.h"
#include "tracer/encode.h"

namespace tracer {
namespace {

Scene checkered_plain(std::uint32_t samples, Texture::Filter filter) {
  Scene scene = scenes::empty(96);
  scene.camera.position = {0, 1, 0};
  scene.camera.look_at = {0.3, 0.9, -1};
  scene.accuracy.samples = samples;
  scene.ambient = {1, 1, 1};
  Texture checker{CheckerTexture{{Color{1, 1, 1}, {0, 0, 0}}}, {2, 2}, {}, ""};
  checker.filter = filter;
  scene.textures.push_back(checker);
  Material floor = scenes::matte({1, 1, 1});
  floor.color = TextureId{0};
  scenes::add(scene, Plane{}, floor);
  return scene;
}

/// Over the pixels whose rows lie below the horizon.
double rms_difference(const Image& a, const Image& b) {
  double sum = 0;
  const std::size_t from = a.rgb.size() * 6 / 10;
  for (std::size_t i = from; i < a.rgb.size(); ++i) sum += std::pow(a.rgb[i] - b.rgb[i], 2);
  return std::sqrt(sum / static_cast<double>(a.rgb.size() - from));
}

TEST(Filtering, OfACheckerToTheHorizonIsCloseToTheMeanOfMany) {
  const Image mean = scenes::render(checkered_plain(1024, Texture::Filter::nearest)).image;
  const auto difference_to_mean = [&](std::uint32_t samples, Texture::Filter filter) {
    return rms_difference(scenes::render(checkered_plain(samples, filter)).image, mean);
  };
  const double filtered = difference_to_mean(1, Texture::Filter::mipmap);
  EXPECT_LT(filtered, 0.06);
  EXPECT_GT(difference_to_mean(1, Texture::Filter::nearest), 3 * filtered) << "filtered " << filtered;
  EXPECT_LT(difference_to_mean(1024, Texture::Filter::mipmap), 0.006) << "it narrows with samples";
}

Image noisy_plain(std::uint32_t samples, Texture::Filter filter) {
  Scene scene = checkered_plain(samples, filter);
  scene.textures[0].pattern = NoiseTexture{{Color{1, 1, 1}, {0, 0, 0}}, 4};
  return scenes::render(scene).image;
}

/// Later samples overlap: a sample's position varies over its part of the pixel, and it covers as much around it.
TEST(Filtering, OfNoiseBlursLittleMoreThanThePixel) {
  const Image mean = noisy_plain(1024, Texture::Filter::nearest);
  for (const auto& [samples, share] : {std::pair{1u, 0.4}, {4u, 1.0}, {16u, 1.3}}) {
    const double filtered = rms_difference(noisy_plain(samples, Texture::Filter::mipmap), mean);
    const double unfiltered = rms_difference(noisy_plain(samples, Texture::Filter::nearest), mean);
    EXPECT_LT(filtered, share * unfiltered) << samples << " samples";
  }
}

/// Expects that the claimed error of a filtered render contains its true error, which the variance does not show.
void expect_claim(const Rendered& filtered, const Image& truth) {
  const double error = compare(to_display(filtered.image), to_display(truth))->rmse;
  EXPECT_GT(error, 2 * filtered.error.sampling);
  EXPECT_GT(filtered.error.estimate, error);
  EXPECT_LT(filtered.error.estimate, 2.5 * error);
}

/// Holes in the dark squares of the same checker: the mean of a square and a hole is not their product's mean.
Scene plain_of_holes(std::uint32_t samples, Texture::Filter filter) {
  Scene scene = checkered_plain(samples, filter);
  scene.materials.back().opacity = TextureId{0};
  return scene;
}

TEST(Filtering, OfColorsAndOpacityIsPartOfTheClaimedError) {
  const Image truth = scenes::render(plain_of_holes(1024, Texture::Filter::nearest)).image;
  for (const std::uint32_t samples : {16u, 64u}) {
    SCOPED_TRACE(samples);
    expect_claim(scenes::render(plain_of_holes(samples, Texture::Filter::mipmap)), truth);
  }
}

/// Across a long and narrow pixel the filter of an image is far wider than the pixel.
Scene stretched_plain(std::uint32_t samples, Texture::Filter filter, Assets& assets) {
  constexpr std::uint32_t side = 64;
  Image stripes{side, side, {}};
  for (std::uint32_t i = 0; i < side * side; ++i)
    stripes.rgb.insert(stripes.rgb.end(), 3, i / 4 % 2 == 0 ? 0.0F : 1.0F);
  assets.bytes = {encode(stripes, Format::exr)->bytes};
  Scene scene = checkered_plain(samples, filter);
  scene.assets = {{"stripes.exr", "/textures/stripes/file"}};
  scene.textures[0].pattern = ImageTexture{AssetId{0}, ColorSpace::linear};
  scene.textures[0].scale = {0.2, 8};
  return scene;
}

TEST(Filtering, OfAStretchedImageIsPartOfTheClaimedError) {
  Assets assets;
  const Image truth = scenes::render(stretched_plain(1024, Texture::Filter::bilinear, assets), 0, assets).image;
  expect_claim(scenes::render(stretched_plain(64, Texture::Filter::mipmap, assets), 0, assets), truth);
}

TEST(Filtering, IsMeasuredByFewOfTheSamples) {
  for (const std::uint32_t samples : {1U, 16U}) {
    Scene scene = plain_of_holes(samples, Texture::Filter::mipmap);
    scene.image.height = scene.image.width = 256;
    const RenderStatistics statistics = scenes::render(scene).statistics;
    const std::uint64_t pixels = std::uint64_t{samples} * 256 * 256;
    EXPECT_GT(statistics.holdout_samples, 0U) << samples;
    EXPECT_LE(statistics.holdout_samples, std::max(pixels / 64, std::uint64_t{64 * 4 * 8})) << samples;
  }
}

TEST(Filtering, OfNoTextureCostsNoLooks) {
  EXPECT_EQ(scenes::render(plain_of_holes(4, Texture::Filter::nearest)).error.looks, 0u);
}

}  // namespace
}  // namespace tracer
