#include "tests/statistics/code_values.h"

#include <algorithm>
#include <cmath>

namespace statistics {

CodeValueImage image_of(const tracer::Image& image) { return {image.rgb.begin(), image.rgb.end()}; }

double gain_of(const CodeValueImage& linear, const tracer::Output& output) {
  const double gain = std::pow(2.0, output.exposure);
  if (output.overflow != tracer::Output::Overflow::scale || linear.empty()) return gain;
  const double brightest = *std::max_element(linear.begin(), linear.end());
  return brightest * gain > 1 ? 1 / brightest : gain;
}

double code_value_of(double linear, double gain, const tracer::Output& output) {
  double to_display = linear * gain;
  if (output.overflow == tracer::Output::Overflow::reinhard) to_display /= 1 + to_display;
  to_display = std::clamp(to_display, 0.0, 1.0);
  return 255 * (to_display <= 0.0031308 ? 12.92 * to_display : 1.055 * std::pow(to_display, 1 / 2.4) - 0.055);
}

CodeValueImage code_values_of(const CodeValueImage& linear, const tracer::Output& output) {
  const double gain = gain_of(linear, output);
  CodeValueImage values(linear.size());
  std::transform(linear.begin(), linear.end(), values.begin(),
                 [&](double v) { return code_value_of(v, gain, output); });
  return values;
}

}  // namespace statistics
