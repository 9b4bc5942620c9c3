#include "tracer/src/sampling/pixel_state.h"

#include <bit>

namespace tracer {
namespace {

constexpr double Color::*channels[] = {&Color::r, &Color::g, &Color::b};

Color mean_of(const PixelState& pixel, std::size_t half) { return pixel.half[half] * (1.0 / pixel.half_count[half]); }

}  // namespace

double variance_of_one(double variance, std::uint32_t count) {
  static const std::array<double, 32> of_power = [] {
    std::array<double, 32> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = std::exp2(variance_power * static_cast<double>(i));
    return table;
  }();
  if (!std::has_single_bit(count)) return variance * std::pow(static_cast<double>(count), variance_power);
  return variance * of_power[static_cast<std::size_t>(std::countr_zero(count))];
}

double refined_error(const PixelState& pixel, const DisplayTransform& display) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels) {
    const double middle = (first.*channel + second.*channel) / 2,
                 difference = std::abs(first.*channel - second.*channel) / 2;
    const double slope = display.slope_between(middle, std::max(0.0, middle - difference));
    sum += slope * slope * difference * difference;
  }
  return sum;
}

double holdout_error(const PixelState& pixel, const DisplayTransform& display, double usual) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels) {
    const double pilot = pixel.pilot.*channel, fresh = (first.*channel + second.*channel) / 2;
    const double slope = display.slope_between(pilot, std::max(0.0, pilot + std::copysign(usual, fresh - pilot)));
    sum += slope * slope * (pilot - first.*channel) * (pilot - second.*channel);
  }
  return sum;
}

double squared_distance(const PixelState& pixel, const DisplayTransform& display) {
  const Color mean = (mean_of(pixel, 0) + mean_of(pixel, 1)) * 0.5;
  double sum = 0;
  for (const auto channel : channels) {
    const double difference = display.level(mean.*channel) - display.level(pixel.pilot.*channel);
    sum += difference * difference;
  }
  return sum;
}

double holdout_radiance_error(const PixelState& pixel) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels)
    sum += (pixel.pilot.*channel - first.*channel) * (pixel.pilot.*channel - second.*channel) / 3;
  return sum;
}

}  // namespace tracer
