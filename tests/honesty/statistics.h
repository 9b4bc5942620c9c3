#pragma once
/// When a count of broken promises is more than chance.

#include <cstdint>

namespace honesty {

/// Probability that of `trials` independent tries, each of which fails with `probability`, at least `failures` do.
/// Exact: the sum of the binomial's terms, in long double. 0 < probability < 1.
long double binomial_tail(std::uint64_t trials, std::uint64_t failures, long double probability);

/// How rare a count must be before it is held against the tracer.
inline constexpr long double significance = 1e-3L;

/// Promises kept and broken.
struct Coverage {
  std::uint64_t trials = 0, misses = 0;
  void add(bool covered) {
    ++trials;
    misses += covered ? 0 : 1;
  }
  /// Whether so many misses, or more, would come by chance less often than `significance` if each promise held with
  /// `confidence`.
  [[nodiscard]] bool rejected(double confidence) const {
    return trials > 0 && binomial_tail(trials, misses, 1 - static_cast<long double>(confidence)) < significance;
  }
};

}  // namespace honesty
