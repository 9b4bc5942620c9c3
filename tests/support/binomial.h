#pragma once
/// Exact binomial test of the coverage of confidence intervals.

#include <cmath>
#include <cstdint>

namespace statistics {

/// Probability of at least `failures` failures in `trials` independent trials, each of which fails with `probability`.
/// Exact: the sum of the binomial's terms, in long double. 0 < probability < 1.
inline long double binomial_tail(std::uint64_t trials, std::uint64_t failures, long double probability) {
  if (failures == 0) return 1;
  if (failures > trials) return 0;
  const auto n = static_cast<long double>(trials), k0 = static_cast<long double>(failures);
  long double term = std::exp(std::lgamma(n + 1) - std::lgamma(k0 + 1) - std::lgamma(n - k0 + 1) +
                              k0 * std::log(probability) + (n - k0) * std::log1p(-probability));
  long double sum = 0;
  for (long double k = k0; k <= n; ++k) {
    sum += term;
    term *= probability / (1 - probability) * (n - k) / (k + 1);
  }
  return sum;
}

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
