#include "tracer/src/sampling/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/math/lanes.h"

namespace tracer {
namespace {

constexpr double confidence = 0.95;

}  // namespace

WHITTLE_WIDE SummedErrors summed(std::span<const float> squared_errors) {
  double squared[lanes] = {}, spread[lanes] = {};
  const float* const errors = squared_errors.data();
  const std::size_t complete = squared_errors.size() / lanes * lanes;
  for (std::size_t first = 0; first < complete; first += lanes)
    for (int i = 0; i < lanes; ++i) {
      const double error = errors[first + static_cast<std::size_t>(i)];
      squared[i] += error;
      spread[i] += error * error;
    }
  SummedErrors sum;
  for (int i = 0; i < lanes; ++i) sum.add({squared[i], spread[i]});
  for (std::size_t i = complete; i < squared_errors.size(); ++i) sum.add(errors[i]);
  return sum;
}

void SampledError::add_possible(double squared_error) {
  const double margin = std::hypot(squared_upper - squared, error_deviations * squared_error);
  squared += squared_error;
  squared_upper = squared + margin;
}

SampledError SummedErrors::estimated() const {
  return {squared, std::max(0.0, squared + error_deviations * std::sqrt(spread))};
}

void add_approximation(ErrorEstimate& error, const SampledError& approximation, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  error.approximation = std::sqrt(approximation.squared_upper / channels);
  error.approximation_min =
      std::sqrt(std::max(0.0, 2 * approximation.squared - approximation.squared_upper) / channels);
  for (double* const total : {&error.estimate, &error.worst_tile}) *total = std::hypot(*total, error.approximation);
}

ErrorEstimate error_estimate(const ErrorParts& parts, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  const auto root = [&](double squared) { return std::sqrt(squared / channels); };
  ErrorEstimate error;
  error.confidence = confidence;
  error.sampling = root(parts.sampled.squared_upper);
  error.depth = root(parts.omitted.depth);
  error.cutoff = root(parts.omitted.cutoff);
  error.tone = root(parts.tone);
  const double fixed = parts.omitted.both + parts.tone;
  error.estimate = root(parts.sampled.squared_upper + fixed);
  add_approximation(error, parts.approximation, pixels);
  return error;
}

}  // namespace tracer
