#pragma once
/// Statistics of claimed against true errors: coverage with an exact binomial test, and tightness.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "tests/statistics/error_coverage/truth.h"
#include "tests/support/binomial.h"

namespace error_coverage {

/// Differences below this are caused by single precision and count as equal, in levels.
inline constexpr double error_resolution = 0.005;
/// Probability of the claims.
inline constexpr double claimed_confidence = 0.95;
/// Required share of close claims.
inline constexpr double close_share_min = 0.85;

/// One claim and the truth. Errors in levels.
struct Trial {
  std::string family{}, scene{}, setting{};
  Canvas canvas{};
  std::uint64_t seed = 0;
  double claimed = 0;
  std::optional<double> target{};
  bool target_met = true;  ///< as claimed
  double proven = std::numeric_limits<double>::infinity();
  MeasuredError error{};
  double samples_per_pixel = 0;

  /// True error; 0 if its estimate is negative.
  [[nodiscard]] double truth() const { return std::sqrt(std::max(0.0, error.squared)); }
  /// The same less two standard errors of the reference, which are granted to the claim.
  [[nodiscard]] double truth_lower() const {
    return std::sqrt(std::max(0.0, error.squared - 2 * error.standard_error));
  }
  /// The true error is larger than the claim.
  [[nodiscard]] bool broken() const { return truth_lower() > claimed + error_resolution; }
  /// The true error is larger than the proven bound.
  [[nodiscard]] bool disproved() const { return truth_lower() > proven + error_resolution; }
  /// true / claimed is in [0.4, 1.05].
  [[nodiscard]] bool close() const {
    return truth() <= 1.05 * claimed + error_resolution && truth() >= 0.4 * claimed - error_resolution;
  }
  /// The claim is below a tenth of a true error of more than 0.1 level.
  [[nodiscard]] bool underclaimed() const { return truth_lower() > 0.1 && claimed < 0.1 * truth_lower(); }
  /// The target is reported as met, but the true error is larger.
  [[nodiscard]] bool target_exceeded() const {
    return target && target_met && truth_lower() > *target + error_resolution;
  }
};

struct ClaimStatistics {
  std::uint64_t trials = 0, broken = 0, disproved = 0, close = 0, underclaimed = 0, target_exceeded = 0;

  void add(const Trial& trial) {
    ++trials;
    broken += trial.broken() ? 1 : 0;
    disproved += trial.disproved() ? 1 : 0;
    close += trial.close() ? 1 : 0;
    underclaimed += trial.underclaimed() ? 1 : 0;
    target_exceeded += trial.target_exceeded() ? 1 : 0;
  }
  [[nodiscard]] double broken_share() const {
    return trials == 0 ? 0 : static_cast<double>(broken) / static_cast<double>(trials);
  }
  [[nodiscard]] double close_share() const {
    return trials == 0 ? 1 : static_cast<double>(close) / static_cast<double>(trials);
  }
  /// Probability of at least as many broken claims if each claim holds with `claimed_confidence`.
  [[nodiscard]] double p_value() const {
    return static_cast<double>(statistics::binomial_tail(trials, broken, 1 - claimed_confidence));
  }
  /// Too many broken claims or disproved bounds, or a claim that is underclaimed.
  [[nodiscard]] bool rejected() const {
    const auto rare = [&](std::uint64_t failures) {
      return statistics::Coverage{trials, failures}.rejected(claimed_confidence);
    };
    return underclaimed > 0 || rare(broken) || rare(disproved);
  }
};

}  // namespace error_coverage
