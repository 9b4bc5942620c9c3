#include "tracer/src/sampling/confidence_sequence.h"

#include <algorithm>
#include <limits>

namespace tracer {
namespace {

constexpr double observation_min = -0.25;
/// Relative distance from the root at which the iteration ends; every iterate is a valid bound.
constexpr double root_tolerance = 1e-9;

}  // namespace

void ConfidenceSequence::add(double observation) {
  const double value = observation <= 1 ? std::max(observation, observation_min) : 1;
  ++count_;
  sum_ += value;
  for (std::size_t i = 0; i < bets.size(); ++i) log_products_[i] += std::log1p(-bets[i].fraction * value);
}

double ConfidenceSequence::upper_bound() const {
  if (count_ == 0) return 1;
  // W is at least each of its terms, so its root is at most each of theirs, which are closed forms.
  double bound = 1;
  for (std::size_t i = 0; i < bets.size(); ++i) {
    const double log_factor = (log_products_[i] + std::log(bets[i].weight) + log_alpha_) / static_cast<double>(count_);
    bound = std::min(bound, -std::expm1(log_factor) / bets[i].fraction);
  }
  if (!(bound < 1)) return 1;
  // log W is convex: a logarithm of a sum of exponentials of -n log(1 - f m), which are convex. So Newton's method
  // descends to the root and does not cross it.
  double step = std::numeric_limits<double>::infinity();
  while (step > root_tolerance * std::abs(bound)) {
    const LogWealth wealth = log_wealth(bound);
    step = (wealth.value + log_alpha_) / wealth.slope;
    bound -= std::max(0.0, step);
  }
  return std::max(0.0, bound);
}

ConfidenceSequence::LogWealth ConfidenceSequence::log_wealth(double mean) const {
  const auto count = static_cast<double>(count_);
  std::array<double, bets.size()> logs{};
  for (std::size_t i = 0; i < bets.size(); ++i)
    logs[i] = std::log(bets[i].weight) + log_products_[i] - count * std::log1p(-bets[i].fraction * mean);
  const double greatest = *std::ranges::max_element(logs);
  double sum = 0, slope = 0;
  for (std::size_t i = 0; i < bets.size(); ++i) {
    const double share = std::exp(logs[i] - greatest);
    sum += share;
    slope += share * count * bets[i].fraction / (1 - bets[i].fraction * mean);
  }
  return {greatest + std::log(sum), slope / sum};
}

}  // namespace tracer
