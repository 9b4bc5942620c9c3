#include "tracer/src/accuracy/levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/film/srgb.h"
#include "tracer/src/math/wide.h"

namespace tracer {
namespace {

struct Scale {
  float gain;
  bool reinhard;
  const float* table;
  int steps;
};

constexpr float all_white = 1e30f;  // to any curve, and to divide by

/// Every third number, from the first on, in floats: twice as many at a time. Off by 1e-4 levels at most, for the
/// table's steps are 0.1 levels apart at most, and a float knows its place to 2^-11 of a step.
WHITTLE_WIDE void show_plane(const float* radiance, std::size_t count, const Scale& scale, float* __restrict shown) {
  const Scale s = scale;
  for (std::size_t i = 0; i < count; ++i) {
    const float light = (radiance[3 * i] > 0 ? radiance[3 * i] : 0) * s.gain;
    const float exposed = light < all_white ? light : all_white;
    const float clamped = exposed < 1 ? exposed : 1.0f;
    const float at = std::sqrt(s.reinhard ? exposed / (1 + exposed) : clamped) * static_cast<float>(s.steps);
    const int whole = static_cast<int>(at), index = whole < s.steps ? whole : s.steps - 1;
    shown[i] = s.table[index] + (s.table[index + 1] - s.table[index]) * (at - static_cast<float>(index));
  }
}

}  // namespace

template <class Curve>
std::vector<float> Levels::tabulated(const Curve& curve) {
  std::vector<float> table(steps + 1);
  for (int i = 0; i <= steps; ++i) {
    const double root = static_cast<double>(i) / steps;
    table[static_cast<std::size_t>(i)] = static_cast<float>(curve(root * root));
  }
  return table;
}

const std::vector<float>& Levels::level_table() {
  static const std::vector<float> table = tabulated([](double x) { return 255 * srgb_from_linear(x); });
  return table;
}

/// The derivative of the curve (IEC 61966-2-1:1999, clause 5.2).
const std::vector<float>& Levels::slope_table() {
  static const std::vector<float> table =
      tabulated([](double x) { return 255 * (x <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(x, 1 / 2.4 - 1)); });
  return table;
}

Levels::Levels(const Output& output, double brightest)
    : reinhard_(output.overflow == Output::Overflow::reinhard),
      gain_(std::exp2(output.exposure)),
      level_(level_table()),
      slope_(slope_table()) {
  if (output.overflow == Output::Overflow::scale && brightest * gain_ > 1) gain_ = 1 / brightest;
  white_ = reinhard_ ? std::numeric_limits<double>::infinity() : 1 / gain_;
}

double Levels::slope(double radiance) const {
  if (radiance > white_) return 0;
  const double shown = displayed(radiance);
  const double tone = reinhard_ ? (1 - shown) * (1 - shown) : 1;  // derivative of x / (1 + x)
  return of(slope_, shown) * tone * gain_;
}

double Levels::slope_between(double a, double b) const {
  // Nearer than the table is exact, their difference would be noise.
  if (std::abs(a - b) * gain_ < 1e-3) return slope(std::min(a, b));
  return (level(a) - level(b)) / (a - b);
}

void Levels::show(std::span<const float> rgb, std::array<std::vector<float>, 3>& planes) const {
  for (std::size_t channel = 0; channel < 3; ++channel)
    show_plane(rgb.data() + channel, rgb.size() / 3,
               {static_cast<float>(std::min<double>(gain_, all_white)), reinhard_, level_.data(), steps},
               planes[channel].data());
}

}  // namespace tracer
