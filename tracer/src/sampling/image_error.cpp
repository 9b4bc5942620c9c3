#include "tracer/src/sampling/image_error.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/sampling/radiance_bound.h"

namespace tracer {
namespace {

/// From a squared error, the channels added up, to the root mean square of the channels.
float error_of(double squared) { return static_cast<float>(std::sqrt(squared / 3)); }

}  // namespace

double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb) {
  const bool needed = scene.output.overflow == Output::Overflow::scale || !radiance_bound(scene);
  return needed && !rgb.empty() ? *std::max_element(rgb.begin(), rgb.end()) : 0;
}

RadianceBound hideable(const CompiledScene& scene, double brightest_pixel) {
  const auto bound = radiance_bound(scene);
  return bound ? RadianceBound{*bound, true} : RadianceBound{brightest_pixel, false};
}

void add(MissingError& sums, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& judging) {
  const double depth = omitted.depth * judging.hideable.radiance;
  const double cutoff = omitted.cutoff * judging.hideable.radiance + omitted.culled;
  if (!(depth + cutoff > 0)) return;
  for (int channel = 0; channel < 3; ++channel) sums.add(rgb[channel], depth, cutoff, judging.levels);
}

float pixel_error(double variance, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& judging) {
  MissingError lacks;
  add(lacks, rgb, omitted, judging);
  return error_of(variance + lacks.both);
}

namespace {

SampledError account_for_samples(Image& image, const UniformPixels& pixels, const ErrorContext& judging,
                                 const InParallel& in_parallel) {
  const Blocks blocks(pixels.rgb.size() / 3, pixels.width);
  std::vector<SummedErrors> parts(blocks.count());
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    UniformVariance variances(pixels, judging.levels);
    SummedErrors part;
    for (std::size_t y = blocks.first_row(block); y < blocks.first_row(block + 1); ++y) {
      const std::span<const float> variance = variances.row(y);
      part.add(summed(variance));
      if (image.layers.error.empty()) continue;
      float* const error = image.layers.error.data() + y * pixels.width;
      for (std::size_t x = 0; x < variance.size(); ++x) error[x] = error_of(variance[x]);
    }
    parts[block] = part;
  });
  SummedErrors whole;
  for (const SummedErrors& part : parts) whole.add(part);
  return whole.known();
}

/// After the samples: adds to what the layer `error` has of them.
MissingError account_for_lacks(Image& image, std::span<const std::vector<OmittedSample>> lacks,
                               const ErrorContext& judging, const InParallel& in_parallel) {
  std::vector<MissingError> parts(lacks.size());
  in_parallel(lacks.size(), [&](std::uint64_t tile) {
    for (const OmittedSample& lack : lacks[tile]) {
      MissingError one;
      add(one, image.rgb.data() + 3 * std::size_t{lack.place}, lack.omitted, judging);
      parts[tile].add(one);
      if (image.layers.error.empty()) continue;
      float& error = image.layers.error[lack.place];
      error = error_of(3.0 * error * error + one.both);
    }
  });
  MissingError whole;
  for (const MissingError& part : parts) whole.add(part);
  return whole;
}

}  // namespace

UniformAccount account_for(Image& image, const UniformPixels& pixels, std::span<const std::vector<OmittedSample>> lacks,
                           const ErrorContext& judging, const InParallel& in_parallel) {
  const SampledError sampled = account_for_samples(image, pixels, judging, in_parallel);
  return {sampled, account_for_lacks(image, lacks, judging, in_parallel)};
}

}  // namespace tracer
