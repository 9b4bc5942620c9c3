#include "tracer/src/integrator/picture_error.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/accuracy/radiance_bound.h"

namespace tracer {
namespace {

void add(MissingError& sums, const float* rgb, const MissingLight& missing, const Hideable& hideable,
         const Levels& levels) {
  const double depth = missing.depth * hideable.radiance;
  const double cutoff = missing.cutoff * hideable.radiance + missing.spared;
  if (!(depth + cutoff > 0)) return;
  for (int channel = 0; channel < 3; ++channel) sums.add(rgb[channel], depth, cutoff, levels);
}

}  // namespace

Hideable hideable(const CompiledScene& scene, double brightest_pixel) {
  const auto bound = radiance_bound(scene);
  return bound ? Hideable{*bound, true} : Hideable{brightest_pixel, false};
}

MissingError missing_error(std::span<const float> rgb, std::span<const MissingLight> missing, const Hideable& hideable,
                           const Levels& levels) {
  MissingError sums;
  for (std::size_t i = 0; i < missing.size(); ++i) add(sums, rgb.data() + 3 * i, missing[i], hideable, levels);
  return sums;
}

void write_error_layer(Image& image, std::span<const float> variances, std::span<const MissingLight> missing,
                       const Hideable& hideable, const Levels& levels) {
  for (std::size_t i = 0; i < image.layers.error.size(); ++i) {
    MissingError lacks;
    if (!missing.empty()) add(lacks, image.rgb.data() + 3 * i, missing[i], hideable, levels);
    image.layers.error[i] = static_cast<float>(std::sqrt((variances[i] + lacks.both) / 3));
  }
}

double brightest(std::span<const float> rgb) { return rgb.empty() ? 0 : *std::max_element(rgb.begin(), rgb.end()); }

}  // namespace tracer
