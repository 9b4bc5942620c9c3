#include "tracer/src/accuracy/pixel_state.h"

#include <cmath>

namespace tracer {
namespace {

/// The curve's slope at `mean`, known to within `spread`: a mean above white may stand for one below.
double slope_around(const Levels& levels, double mean, double spread) {
  if (mean <= levels.white()) return levels.slope(mean);
  return mean - spread < levels.white() ? levels.slope(levels.white()) : 0;
}

PixelError channel_error(double before, double first, double second, double mean, double weight, const Levels& levels) {
  const double fresh = (first + second) / 2, apart = (first - second) / 2;
  const double slope = slope_around(levels, mean, std::abs(apart) + std::abs(before - fresh));
  const double error_before = (before - first) * (before - second);
  const double with = weight * weight * error_before + (1 - weight) * (1 - weight) * apart * apart;
  return {slope * slope * error_before, slope * slope * with};
}

}  // namespace

PixelError error_of(const PixelState& pixel, const Levels& levels) {
  const Color before = pixel.count > 0 ? pixel.sum * (1.0 / pixel.count) : Color{};
  const Color first = pixel.fresh[0] * (1.0 / pixel.fresh_count[0]);
  const Color second = pixel.fresh[1] * (1.0 / pixel.fresh_count[1]);
  const Color mean = pixel.mean();
  const double weight = static_cast<double>(pixel.count) / pixel.total();
  PixelError error;
  for (const auto channel : {&Color::r, &Color::g, &Color::b}) {
    const PixelError one =
        channel_error(before.*channel, first.*channel, second.*channel, mean.*channel, weight, levels);
    error.before += one.before;
    error.with += one.with;
  }
  return error;
}

}  // namespace tracer
