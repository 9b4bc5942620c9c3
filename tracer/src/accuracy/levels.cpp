#include "tracer/src/accuracy/levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/film/srgb.h"

namespace tracer {
namespace {

constexpr std::size_t steps = 4096;

template <class Curve>
std::vector<float> tabulated(const Curve& curve) {
  std::vector<float> table(steps + 1);
  for (std::size_t i = 0; i <= steps; ++i) {
    const double root = static_cast<double>(i) / steps;
    table[i] = static_cast<float>(curve(root * root));
  }
  return table;
}

const std::vector<float>& level_table() {
  static const std::vector<float> table = tabulated([](double x) { return 255 * srgb_from_linear(x); });
  return table;
}

/// The derivative of the curve (IEC 61966-2-1:1999, clause 5.2).
const std::vector<float>& slope_table() {
  static const std::vector<float> table =
      tabulated([](double x) { return 255 * (x <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(x, 1 / 2.4 - 1)); });
  return table;
}

}  // namespace

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

double Levels::displayed(double radiance) const {
  const double exposed = std::max(0.0, radiance) * gain_;
  return reinhard_ ? exposed / (1 + exposed) : std::min(exposed, 1.0);
}

double Levels::of(const std::vector<float>& table, double displayed) {
  const double at = std::sqrt(displayed) * steps;
  const auto index = std::min(static_cast<std::size_t>(at), steps - 1);
  const double part = at - static_cast<double>(index);
  return table[index] + (table[index + 1] - table[index]) * part;
}

}  // namespace tracer
