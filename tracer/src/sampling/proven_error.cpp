#include "tracer/src/sampling/proven_error.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/sampling/confidence_sequence.h"

namespace tracer {

double sum_bound(double mean, double largest, double alpha) {
  if (!(mean > 0)) return 0;
  const double needed = -std::log(alpha) * largest / mean;
  const auto exponent = [](double d) { return (1 + d) * std::log1p(d) - d; };
  double low = 0, high = 1;
  while (exponent(high) < needed) high *= 2;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (exponent(middle) < needed ? low : high) = middle;
  }
  return mean * (1 + high);
}

double proven_refined_error(std::span<const PixelState> pixels, const DisplayTransform& display, double alpha) {
  double largest = 0, unmeasured = 0;
  for (const PixelState& pixel : pixels) {
    if (pixel.refined() && pixel.measured()) largest = std::max(largest, double{pixel.bound});
    if (pixel.refined() && !pixel.measured()) unmeasured += pixel.bound;
  }
  if (!(largest > 0)) return unmeasured;
  ConfidenceSequence sequence(alpha / 2);
  for (const PixelState& pixel : pixels)
    if (pixel.refined() && pixel.measured()) sequence.add(bounded_refined_error(pixel, display) / (largest / 4));
  const double mean = sequence.upper_bound() * static_cast<double>(sequence.count()) * largest / 4;
  return sum_bound(mean, largest, alpha / 2) + unmeasured;
}

}  // namespace tracer
