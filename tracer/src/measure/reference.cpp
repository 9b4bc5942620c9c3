#include "tracer/reference.h"

#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

constexpr std::uint32_t picture_samples_most = 256;  // enough that a picture's build is little of its time
constexpr std::uint32_t pictures_least = 8;          // a spread of fewer is a guess
constexpr double cutoff = 1e-3;  // by chance: any is right in the mean, small ones cost 1 / cutoff rays in glass
constexpr std::uint32_t depth = 200;

}  // namespace

Reference empty_reference(const Scene& scene, std::uint32_t samples) {
  const PixelWindow window = scene.image.window();
  Reference reference{.width = window.width(), .height = window.height()};
  reference.picture_samples = std::clamp(samples / pictures_least, 2u, picture_samples_most);
  const auto values = static_cast<std::size_t>(3 * window.pixels());
  for (std::vector<double>* sums : {&reference.light, &reference.codes, &reference.code_squares}) sums->resize(values);
  return reference;
}

Scene reference_scene(const Scene& scene, const Reference& reference) {
  Scene independent = scene;
  Accuracy& accuracy = independent.accuracy;
  accuracy = Accuracy();
  accuracy.samples = reference.picture_samples;
  accuracy.max_depth = depth;
  accuracy.cutoff = cutoff;
  accuracy.cutoff_by_chance = true;
  // An odd factor, so that no number of pictures comes back to the seed of the pictures that are measured.
  accuracy.seed = scene.accuracy.seed + 0x9e3779b97f4a7c15u * (std::uint64_t{reference.pictures} + 1);
  for (Texture& texture : independent.textures)
    if (texture.filter == Texture::Filter::mipmap) texture.filter = Texture::Filter::bilinear;
  independent.output.layers.clear();
  return independent;
}

void add(Reference& reference, const Image& image, const Output& output) {
  const ShownPicture picture = shown(image, output);
  for (std::size_t i = 0; i < reference.light.size(); ++i) {
    const double code = picture.codes[i];
    reference.light[i] += image.rgb[i];
    reference.codes[i] += code;
    reference.code_squares[i] += code * code;
  }
  ++reference.pictures;
}

double standard_error(const Reference& reference) {
  const double count = reference.pictures;
  double sum = 0;
  const std::size_t row = 3 * std::size_t{reference.width};
  for (std::size_t first = 0; first < reference.codes.size(); first += row) {
    double of_row = 0;
    for (std::size_t i = first; i < first + row; ++i) {
      const double code = reference.codes[i];
      // Codes are floats below 2^16: their squares sum exactly for pictures that are equal.
      of_row += std::max(0.0, reference.code_squares[i] - code * code / count) / (count - 1);
    }
    sum += of_row;
  }
  return std::sqrt(sum / static_cast<double>(reference.codes.size()) / count) / codes_per_level;
}

ShownPicture shown(const Reference& reference, const Output& output) {
  Image mean;
  mean.width = reference.width;
  mean.height = reference.height;
  mean.rgb.reserve(reference.light.size());
  for (const double sum : reference.light) mean.rgb.push_back(static_cast<float>(sum / reference.pictures));
  return shown(mean, output);
}

}  // namespace tracer
