#include "tests/honesty/levels.h"

#include <algorithm>
#include <cmath>

namespace honesty {

LevelImage image_of(const tracer::Image& image) { return {image.rgb.begin(), image.rgb.end()}; }

double gain_of(const LevelImage& linear, const tracer::Output& output) {
  const double gain = std::pow(2.0, output.exposure);
  if (output.overflow != tracer::Output::Overflow::scale || linear.empty()) return gain;
  const double brightest = *std::max_element(linear.begin(), linear.end());
  return brightest * gain > 1 ? 1 / brightest : gain;
}

double level_of(double linear, double gain, const tracer::Output& output) {
  double to_display = linear * gain;
  if (output.overflow == tracer::Output::Overflow::reinhard) to_display /= 1 + to_display;
  to_display = std::clamp(to_display, 0.0, 1.0);
  return 255 * (to_display <= 0.0031308 ? 12.92 * to_display : 1.055 * std::pow(to_display, 1 / 2.4) - 0.055);
}

LevelImage levels_of(const LevelImage& linear, const tracer::Output& output) {
  const double gain = gain_of(linear, output);
  LevelImage levels(linear.size());
  std::transform(linear.begin(), linear.end(), levels.begin(), [&](double v) { return level_of(v, gain, output); });
  return levels;
}

}  // namespace honesty
