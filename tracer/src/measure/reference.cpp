// Reference image of a measurement: independent images, summed in double.
#include <algorithm>
#include <cmath>

#include "tracer/measure.h"

namespace tracer {
namespace {

constexpr std::uint32_t image_samples_max = 256;   // makes the time of compile() negligible
constexpr std::uint32_t reference_images_min = 8;  // the variance of fewer images is too uncertain

/// Mean radiance plus `deviations` standard deviations.
Image mean_beside(const Reference& reference, double deviations) {
  const double count = reference.images;
  Image image;
  image.width = reference.width;
  image.height = reference.height;
  image.rgb.reserve(reference.radiance_sum.size());
  for (std::size_t i = 0; i < reference.radiance_sum.size(); ++i) {
    const double radiance = reference.radiance_sum[i];
    // The summands are floats: the squares of equal images sum exactly.
    const double variance = std::max(0.0, reference.squared_sum[i] - radiance * radiance / count) / (count - 1) / count;
    const double beside = deviations == 0 ? 0 : deviations * std::sqrt(variance);
    image.rgb.push_back(static_cast<float>(radiance / count + beside));
  }
  return image;
}

}  // namespace

Reference empty_reference(const Scene& scene, std::uint32_t samples) {
  const PixelWindow window = scene.image.window();
  Reference reference{.width = window.width(), .height = window.height()};
  reference.model = scene.accuracy.model;
  reference.image_samples = std::clamp(samples / reference_images_min, 2u, image_samples_max);
  const auto values = static_cast<std::size_t>(3 * window.pixels());
  for (std::vector<double>* sums : {&reference.radiance_sum, &reference.squared_sum}) sums->resize(values);
  return reference;
}

Scene reference_scene(const Scene& scene, const Reference& reference) {
  Scene independent = scene;
  Accuracy& accuracy = independent.accuracy;
  accuracy = Accuracy();
  accuracy.model = reference.model;
  accuracy.samples = reference.image_samples;
  // The factor is odd, so no number of images repeats the seed of the measured images.
  accuracy.seed = scene.accuracy.seed + 0x9e3779b97f4a7c15u * (std::uint64_t{reference.images} + 1);
  for (Texture& texture : independent.textures)
    if (texture.filter == Texture::Filter::mipmap) texture.filter = Texture::Filter::bilinear;
  independent.output.layers.clear();
  return independent;
}

void add(Reference& reference, const Image& image) {
  for (std::size_t i = 0; i < reference.radiance_sum.size(); ++i) {
    const double radiance = image.rgb[i];
    reference.radiance_sum[i] += radiance;
    reference.squared_sum[i] += radiance * radiance;
  }
  ++reference.images;
}

double standard_error(const Reference& reference, const Output& output) {
  const DisplayImage below = to_display(mean_beside(reference, -1), output);
  const DisplayImage above = to_display(mean_beside(reference, 1), output);
  double sum = 0;
  const std::size_t row = 3 * std::size_t{reference.width};
  for (std::size_t first = 0; first < above.codes.size(); first += row) {
    double of_row = 0;
    for (std::size_t i = first; i < first + row; ++i) {
      const double half = (double{above.codes[i]} - below.codes[i]) / 2;
      of_row += half * half;
    }
    sum += of_row;
  }
  return std::sqrt(sum / static_cast<double>(above.codes.size())) / codes_per_level;
}

Image mean_image(const Reference& reference) { return mean_beside(reference, 0); }

DisplayImage to_display(const Reference& reference, const Output& output) {
  return to_display(mean_image(reference), output);
}

}  // namespace tracer
