#include "tracer/src/display/tone_mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tracer {
namespace {

float float_of(double value) { return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max())); }

/// Factor that scales the largest channel value of the image to at most 1.
double scale_of(const std::vector<float>& linear, double gain) {
  double brightest = 0;
  for (const float value : linear) brightest = std::max(brightest, static_cast<double>(value));
  return brightest * gain > 1 ? 1 / brightest : gain;
}

}  // namespace

std::vector<float> straight_color(const Image& image) {
  std::vector<float> straight = image.rgb;
  for (std::size_t pixel = 0; pixel < image.alpha.size(); ++pixel) {
    for (std::size_t channel = 3 * pixel; channel < 3 * pixel + 3; ++channel) {
      const float alpha = image.alpha[pixel];
      straight[channel] = alpha > 0 ? float_of(static_cast<double>(straight[channel]) / alpha) : 0;
    }
  }
  return straight;
}

void apply_tone(std::vector<float>& linear, const Output& output) {
  using Overflow = Output::Overflow;
  double gain = std::exp2(output.exposure);
  if (output.overflow == Overflow::scale) gain = scale_of(linear, gain);
  if (gain == 1 && output.overflow != Overflow::reinhard) return;
  for (float& value : linear) {
    const double exposed = value * gain;
    value = float_of(output.overflow == Overflow::reinhard ? exposed / (1 + exposed) : exposed);
  }
}

}  // namespace tracer
