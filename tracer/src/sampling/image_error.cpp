#include "tracer/src/sampling/image_error.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/sampling/radiance_bound.h"

namespace tracer {
namespace {

/// Root mean square over the channels of a squared error that is their sum.
float rms_of_channels(double squared) { return static_cast<float>(std::sqrt(squared / 3)); }

SampledError measure_samples(Image& image, const UniformPixels& pixels, const ErrorContext& context,
                             const InParallel& in_parallel) {
  const Blocks blocks(pixels.rgb.size() / 3, pixels.width);
  std::vector<SummedErrors> block_sums(blocks.count());
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    UniformVariance variances(pixels, context.display);
    SummedErrors sum;
    for (std::size_t y = blocks.first_row(block); y < blocks.first_row(block + 1); ++y) {
      const std::span<const float> variance = variances.row(y);
      sum.add(summed(variance));
      if (image.layers.error.empty()) continue;
      float* const error = image.layers.error.data() + y * pixels.width;
      for (std::size_t x = 0; x < variance.size(); ++x) error[x] = rms_of_channels(variance[x]);
    }
    block_sums[block] = sum;
  });
  SummedErrors sum;
  for (const SummedErrors& block_sum : block_sums) sum.add(block_sum);
  return sum.estimated();
}

/// Precondition: measure_samples() wrote the layer `error`, to which it adds.
OmittedError measure_omitted(Image& image, std::span<const std::vector<OmittedSample>> omitted,
                             const ErrorContext& context, const InParallel& in_parallel) {
  std::vector<OmittedError> tile_sums(omitted.size());
  in_parallel(omitted.size(), [&](std::uint64_t tile) {
    for (const OmittedSample& sample : omitted[tile]) {
      OmittedError pixel;
      add(pixel, image.rgb.data() + 3 * std::size_t{sample.place}, sample.omitted, context);
      tile_sums[tile].add(pixel);
      if (image.layers.error.empty()) continue;
      float& error = image.layers.error[sample.place];
      error = rms_of_channels(3.0 * error * error + pixel.both);
    }
  });
  OmittedError sum;
  for (const OmittedError& tile_sum : tile_sums) sum.add(tile_sum);
  return sum;
}

}  // namespace

double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb) {
  const bool needed = scene.output.overflow == Output::Overflow::scale || !radiance_bound(scene);
  return needed && !rgb.empty() ? *std::max_element(rgb.begin(), rgb.end()) : 0;
}

RadianceBound bound_omitted_radiance(const CompiledScene& scene, double brightest_pixel) {
  const auto bound = radiance_bound(scene);
  return bound ? RadianceBound{*bound, true} : RadianceBound{brightest_pixel, false};
}

void add(OmittedError& sums, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& context) {
  const double depth = omitted.depth * context.bound.radiance;
  const double cutoff = omitted.cutoff * context.bound.radiance + omitted.culled;
  if (!(depth + cutoff > 0)) return;
  for (int channel = 0; channel < 3; ++channel) sums.add(rgb[channel], depth, cutoff, context.display);
}

float pixel_error(double variance, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& context) {
  OmittedError error;
  add(error, rgb, omitted, context);
  return rms_of_channels(variance + error.both);
}

UniformErrors measure_uniform_errors(Image& image, const UniformPixels& pixels,
                                     std::span<const std::vector<OmittedSample>> omitted, const ErrorContext& context,
                                     const InParallel& in_parallel) {
  const SampledError sampled = measure_samples(image, pixels, context, in_parallel);
  return {sampled, measure_omitted(image, omitted, context, in_parallel)};
}

}  // namespace tracer
