#include "tracer/src/integrator/picture_error.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/accuracy/radiance_bound.h"

namespace tracer {

double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb) {
  const bool needed = scene.output.overflow == Output::Overflow::scale || !radiance_bound(scene);
  return needed && !rgb.empty() ? *std::max_element(rgb.begin(), rgb.end()) : 0;
}

Hideable hideable(const CompiledScene& scene, double brightest_pixel) {
  const auto bound = radiance_bound(scene);
  return bound ? Hideable{*bound, true} : Hideable{brightest_pixel, false};
}

void add(MissingError& sums, const float* rgb, const MissingLight& missing, const Judging& judging) {
  const double depth = missing.depth * judging.hideable.radiance;
  const double cutoff = missing.cutoff * judging.hideable.radiance + missing.spared;
  if (!(depth + cutoff > 0)) return;
  for (int channel = 0; channel < 3; ++channel) sums.add(rgb[channel], depth, cutoff, judging.levels);
}

float pixel_error(double variance, const float* rgb, const MissingLight& missing, const Judging& judging) {
  MissingError lacks;
  add(lacks, rgb, missing, judging);
  return static_cast<float>(std::sqrt((variance + lacks.both) / 3));
}

UniformAccount account_for(Image& image, const UniformPixels& pixels, std::span<const MissingLight> missing,
                           const Judging& judging, const InParallel& in_parallel) {
  struct Part {
    SummedErrors sampled;
    MissingError missing;
  };
  const Blocks blocks(pixels.rgb.size() / 3, pixels.width);
  std::vector<Part> parts(blocks.count());
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    UniformVariance variances(pixels, judging.levels);
    Part part;
    for (std::size_t y = blocks.first_row(block); y < blocks.first_row(block + 1); ++y) {
      const std::span<const float> variance = variances.row(y);
      for (std::size_t x = 0, place = y * pixels.width; x < pixels.width; ++x, ++place) {
        const float* rgb = pixels.rgb.data() + 3 * place;
        const MissingLight lacks = missing.empty() ? MissingLight{} : missing[place];
        part.sampled.add(variance[x]);
        add(part.missing, rgb, lacks, judging);
        if (!image.layers.error.empty()) image.layers.error[place] = pixel_error(variance[x], rgb, lacks, judging);
      }
    }
    parts[block] = part;
  });
  Part whole;
  for (const Part& part : parts) {
    whole.sampled.add(part.sampled);
    whole.missing.add(part.missing);
  }
  return {whole.sampled.known(), whole.missing};
}

}  // namespace tracer
