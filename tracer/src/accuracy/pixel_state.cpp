#include "tracer/src/accuracy/pixel_state.h"

namespace tracer {
namespace {

/// The curve's slope at `mean`, known to within `spread`: a mean above white may stand for one below.
double slope_around(const Levels& levels, double mean, double spread) {
  if (mean <= levels.white()) return levels.slope(mean);
  return mean - spread < levels.white() ? levels.slope(levels.white()) : 0;
}

double refined_error(double first, double second, const Levels& levels) {
  const double apart = (first - second) / 2;
  const double slope = slope_around(levels, (first + second) / 2, std::abs(apart));
  return slope * slope * apart * apart;
}

double audited_error(double pilot, double first, double second, const Levels& levels) {
  const double fresh = (first + second) / 2;
  const double spread = std::abs(first - second) / 2 + std::abs(pilot - fresh);
  const double slope = slope_around(levels, (pilot + first + second) / 3, spread);
  return slope * slope * (pilot - first) * (pilot - second);
}

}  // namespace

double squared_error(const PixelState& pixel, const Levels& levels) {
  const Color first = pixel.half[0] * (1.0 / pixel.half_count[0]);
  const Color second = pixel.half[1] * (1.0 / pixel.half_count[1]);
  double sum = 0;
  for (const auto channel : {&Color::r, &Color::g, &Color::b}) {
    sum += pixel.refined() ? refined_error(first.*channel, second.*channel, levels)
                           : audited_error(pixel.pilot.*channel, first.*channel, second.*channel, levels);
  }
  return sum;
}

}  // namespace tracer
