#include "tests/statistics/error_coverage/claim_statistics.h"

#include <algorithm>
#include <cmath>

#include "tests/support/binomial.h"

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

double ClaimStatistics::p_value() const {
  return static_cast<double>(statistics::binomial_tail(trials, broken, 1 - claimed_confidence));
}

bool ClaimStatistics::rejected() const {
  const auto rare = [&](std::uint64_t failures) {
    return statistics::Coverage{trials, failures}.rejected(claimed_confidence);
  };
  return underclaimed > 0 || rare(broken) || rare(disproved);
}

}  // namespace error_coverage
