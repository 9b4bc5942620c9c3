#include "tracer/src/display/display_transform.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/display/srgb.h"
#include "tracer/src/math/lanes.h"

namespace tracer {
namespace {

constexpr float all_white = 1e30f;  // white for every curve, and safe as a divisor

/// The sRGB curve above its linear part, in levels, as a polynomial in the fourth root of the argument: Chebyshev
/// interpolation of degree 7, with an error of at most 1.3e-4 levels in floats. The table is more accurate, but three
/// times slower for many numbers.
WHITTLE_INLINE float curved_levels(float displayed) {
  const float x = std::sqrt(std::sqrt(displayed));
  const float high = ((-17.338027f * x + 91.531325f) * x - 212.61556f) * x + 292.36133f;
  return (((high * x - 285.81657f) * x + 369.81174f) * x + 32.004051f) * x - 14.938329f;
}

/// Every third element, from the first.
template <bool reinhard>
WHITTLE_INLINE void show_each(const float* radiance, std::size_t count, float gain, float* __restrict to_display) {
  for (std::size_t i = 0; i < count; ++i) {
    const float light = (radiance[3 * i] > 0 ? radiance[3 * i] : 0) * gain;
    const float exposed = light < all_white ? light : all_white;
    const float clamped = exposed < 1 ? exposed : 1.0f;
    const float displayed = reinhard ? exposed / (1 + exposed) : clamped;
    to_display[i] = displayed <= 0.0031308f ? 255 * 12.92f * displayed : curved_levels(displayed);
  }
}
WHITTLE_WIDE void show_plane(const float* radiance, std::size_t count, float gain, bool reinhard, float* to_display) {
  reinhard ? show_each<true>(radiance, count, gain, to_display) : show_each<false>(radiance, count, gain, to_display);
}

}  // namespace

template <class Curve>
std::vector<float> DisplayTransform::tabulated(const Curve& curve) {
  std::vector<float> table(steps + 1);
  for (int i = 0; i <= steps; ++i) {
    const double root = static_cast<double>(i) / steps;
    table[static_cast<std::size_t>(i)] = static_cast<float>(curve(root * root));
  }
  return table;
}

const std::vector<float>& DisplayTransform::level_table() {
  static const std::vector<float> table = tabulated([](double x) { return 255 * srgb_from_linear(x); });
  return table;
}

/// The derivative of the curve (IEC 61966-2-1:1999, clause 5.2).
const std::vector<float>& DisplayTransform::slope_table() {
  static const std::vector<float> table =
      tabulated([](double x) { return 255 * (x <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(x, 1 / 2.4 - 1)); });
  return table;
}

DisplayTransform::DisplayTransform(const Output& output, double brightest)
    : reinhard_(output.overflow == Output::Overflow::reinhard),
      gain_(std::exp2(output.exposure)),
      level_(level_table()),
      slope_(slope_table()) {
  if (output.overflow == Output::Overflow::scale && brightest * gain_ > 1) gain_ = 1 / brightest;
  white_ = reinhard_ ? std::numeric_limits<double>::infinity() : 1 / gain_;
}

double DisplayTransform::slope(double radiance) const {
  if (radiance > white_) return 0;
  const double to_display = displayed(radiance);
  const double tone = reinhard_ ? (1 - to_display) * (1 - to_display) : 1;  // derivative of x / (1 + x)
  return of(slope_, to_display) * tone * gain_;
}

double DisplayTransform::slope_between(double a, double b) const {
  // Below the accuracy of the table, the difference would be noise.
  if (std::abs(a - b) * gain_ < 1e-3) return slope(std::min(a, b));
  return (level(a) - level(b)) / (a - b);
}

void DisplayTransform::show(std::span<const float> rgb, const std::array<float*, 3>& planes) const {
  const auto gain = static_cast<float>(std::min<double>(gain_, all_white));
  for (std::size_t channel = 0; channel < 3; ++channel)
    show_plane(rgb.data() + channel, rgb.size() / 3, gain, reinhard_, planes[channel]);
}

}  // namespace tracer
