#pragma once
/// Exact binomial test of the coverage of confidence intervals.

#include <cstdint>

namespace statistics {

/// Probability of at least `failures` failures in `trials` independent trials, each of which fails with `probability`.
/// Exact: the sum of the binomial's terms, in long double. 0 < probability < 1.
long double binomial_tail(std::uint64_t trials, std::uint64_t failures, long double probability);

/// Level of significance of every test.
inline constexpr long double significance = 1e-3L;

/// Number of intervals, and of those that do not contain the true value.
struct Coverage {
  std::uint64_t trials = 0, misses = 0;
  void add(bool covered) {
    ++trials;
    misses += covered ? 0 : 1;
  }
  /// Returns true if so many misses, or more, have a probability below `significance` when each interval holds with
  /// `confidence`.
  [[nodiscard]] bool rejected(double confidence) const {
    return trials > 0 && binomial_tail(trials, misses, 1 - static_cast<long double>(confidence)) < significance;
  }
};

}  // namespace statistics
