#pragma once
/// Statistics of claimed against true errors: coverage with an exact binomial test, and tightness.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "tests/statistics/error_coverage/truth.h"

namespace error_coverage {

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
  [[nodiscard]] double truth() const;
  /// The same less two standard errors of the reference, which are granted to the claim.
  [[nodiscard]] double truth_lower() const;
  /// The true error is larger than the claim.
  [[nodiscard]] bool broken() const;
  /// The true error is larger than the proven bound.
  [[nodiscard]] bool disproved() const;
  /// true / claimed is in [0.4, 1.05].
  [[nodiscard]] bool close() const;
  /// The claim is below a tenth of a true error of more than 0.1 level.
  [[nodiscard]] bool underclaimed() const;
  /// The target is reported as met, but the true error is larger.
  [[nodiscard]] bool target_exceeded() const;
};

/// Differences below this are caused by single precision and count as equal, in levels.
inline constexpr double error_resolution = 0.005;
/// Probability of the claims.
inline constexpr double claimed_confidence = 0.95;
/// Required share of close claims.
inline constexpr double close_share_min = 0.85;

struct ClaimStatistics {
  std::uint64_t trials = 0, broken = 0, disproved = 0, close = 0, underclaimed = 0, target_exceeded = 0;

  void add(const Trial& trial);
  [[nodiscard]] double broken_share() const;
  [[nodiscard]] double close_share() const;
  /// Probability of at least as many broken claims if each claim holds with `claimed_confidence`.
  [[nodiscard]] double p_value() const;
  /// Too many broken claims or disproved bounds, or a claim that is underclaimed.
  [[nodiscard]] bool rejected() const;
};

}  // namespace error_coverage
