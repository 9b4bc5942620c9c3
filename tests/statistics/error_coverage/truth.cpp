#include "tests/statistics/error_coverage/truth.h"

#include <algorithm>
#include <cmath>

#include "tests/support/scenes.h"

namespace error_coverage {

using namespace tracer;

Scene reference_scene(const Scene& scene, std::uint32_t samples, std::uint64_t seed) {
  Scene reference = scene;
  reference.accuracy = {};
  reference.accuracy.model = scene.accuracy.model;
  reference.accuracy.samples = samples;
  reference.accuracy.seed = seed;
  for (Texture& texture : reference.textures)
    if (texture.filter == Texture::Filter::mipmap) texture.filter = Texture::Filter::bilinear;
  return reference;
}

double worst_tile_mean(const std::vector<double>& squared_errors, std::uint32_t width) {
  const auto height = static_cast<std::uint32_t>(squared_errors.size() / width);
  double worst = 0;
  for (std::uint32_t top = 0; top < height; top += tile_side)
    for (std::uint32_t left = 0; left < width; left += tile_side) {
      const std::uint32_t bottom = std::min(height, top + tile_side), right = std::min(width, left + tile_side);
      double sum = 0;
      for (std::uint32_t y = top; y < bottom; ++y)
        for (std::uint32_t x = left; x < right; ++x) sum += squared_errors[std::size_t{y} * width + x];
      worst = std::max(worst, sum / ((bottom - top) * (right - left)));
    }
  return worst;
}

MeasuredError Truth::error_of(const DisplayImage& image) const {
  const std::size_t pixels = image.codes.size() / 3;
  std::vector<double> squared(pixels);
  double sum = 0, variance = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    double of_pixel = 0, noise = 0;
    for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
      const double x = image.codes[i] / codes_per_level;
      const double a = x - halves_[0].codes[i] / codes_per_level, b = x - halves_[1].codes[i] / codes_per_level;
      of_pixel += a * b;
      noise += (a - b) * (a - b) / 2;
    }
    // The variance of (X - A)(X - B) is 2 d^2 s^2 + s^4 for the error d and the variance s^2 of each half. The channels
    // of a pixel are taken as equal, which overestimates; E (A - B)^4 is 12 s^4 for a normal distribution.
    variance += 2 * std::max(0.0, of_pixel) * noise + noise * noise / 3;
    squared[pixel] = of_pixel / 3;
    sum += of_pixel;
  }
  const double values = 3 * static_cast<double>(pixels);
  return {sum / values, std::sqrt(variance) / values, worst_tile_mean(squared, image.width)};
}

Truth truth_of(const CorpusScene& scene, double reference_samples) {
  if (scene.exact) return Truth(to_display(*scene.exact, scene.scene.output));
  const auto pixels = static_cast<double>(scene.scene.image.window().pixels());
  // The brightest channel of all pixels is one that is too bright, which both images have in common.
  if (scene.scene.output.overflow == Output::Overflow::scale) reference_samples *= 20;
  const auto samples = static_cast<std::uint32_t>(std::clamp(reference_samples / pixels, 64.0, 4096.0));
  constexpr std::uint64_t first_seed = std::uint64_t{1} << 40;  // different from the seeds of all trials
  const auto half = [&](std::uint64_t seed) {
    const Image image = scenes::render(reference_scene(scene.scene, samples, seed), 0, scene.assets).image;
    return to_display(image, scene.scene.output);
  };
  return {half(first_seed), half(first_seed + 1)};
}

}  // namespace error_coverage
