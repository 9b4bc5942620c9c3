#include "tests/statistics/error_coverage/claim_statistics.h"

#include <algorithm>
#include <cmath>

namespace error_coverage {

double Trial::truth() const { return std::sqrt(std::max(0.0, error.squared)); }

double Trial::truth_lower() const { return std::sqrt(std::max(0.0, error.squared - 2 * error.standard_error)); }

bool Trial::broken() const { return truth_lower() > claimed + error_resolution; }

bool Trial::disproved() const { return truth_lower() > proven + error_resolution; }

bool Trial::close() const {
  return truth() <= 1.05 * claimed + error_resolution && truth() >= 0.4 * claimed - error_resolution;
}

bool Trial::underclaimed() const { return truth_lower() > 0.1 && claimed < 0.1 * truth_lower(); }

bool Trial::target_exceeded() const { return target && target_met && truth_lower() > *target + error_resolution; }

double binomial_upper_tail(std::uint64_t trials, std::uint64_t failures, double probability) {
  if (failures == 0) return 1;
  const auto n = static_cast<double>(trials);
  double tail = 0;
  for (std::uint64_t i = failures; i <= trials; ++i) {
    const auto k = static_cast<double>(i);
    tail += std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) + k * std::log(probability) +
                     (n - k) * std::log1p(-probability));
  }
  return std::min(1.0, tail);
}

void ClaimStatistics::add(const Trial& trial) {
  ++trials;
  broken += trial.broken() ? 1 : 0;
  disproved += trial.disproved() ? 1 : 0;
  close += trial.close() ? 1 : 0;
  underclaimed += trial.underclaimed() ? 1 : 0;
  target_exceeded += trial.target_exceeded() ? 1 : 0;
}

double ClaimStatistics::broken_share() const {
  return trials == 0 ? 0 : static_cast<double>(broken) / static_cast<double>(trials);
}

double ClaimStatistics::close_share() const {
  return trials == 0 ? 1 : static_cast<double>(close) / static_cast<double>(trials);
}

double ClaimStatistics::p_value() const { return binomial_upper_tail(trials, broken, 1 - claimed_confidence); }

bool ClaimStatistics::rejected() const {
  const auto rare = [&](std::uint64_t failures) {
    return binomial_upper_tail(trials, failures, 1 - claimed_confidence) < significance;
  };
  return underclaimed > 0 || rare(broken) || rare(disproved);
}

}  // namespace error_coverage
