#include "tracer/src/accuracy/uniform_error.h"

#include "tracer/src/accuracy/contrast.h"

namespace tracer {

std::vector<float> uniform_variance(std::span<const float> rgb, std::span<const float> spread, std::uint32_t samples,
                                    std::uint32_t width, const Levels& levels) {
  std::vector<float> shown(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i) shown[i] = static_cast<float>(levels.level(rgb[i]));
  std::vector<float> variance = contrasts(shown, width);
  constexpr double prior_weight = 2;
  for (std::size_t pixel = 0; pixel < variance.size(); ++pixel) {
    double one = expected_variance(variance[pixel]);
    if (!spread.empty()) {
      double own = 0;
      for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
        const double slope = levels.slope(rgb[i]);
        own += slope * slope * spread[i];
      }
      one = (own * (samples - 1) + one * prior_weight) / (samples - 1 + prior_weight);
    }
    variance[pixel] = static_cast<float>(one / samples);
  }
  return variance;
}

}  // namespace tracer
