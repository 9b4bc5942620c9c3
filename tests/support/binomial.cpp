#include "tests/support/binomial.h"

#include <cmath>

namespace statistics {

long double binomial_tail(std::uint64_t trials, std::uint64_t failures, long double probability) {
  if (failures == 0) return 1;
  if (failures > trials) return 0;
  const auto n = static_cast<long double>(trials);
  const long double odds = probability / (1 - probability);
  const auto k0 = static_cast<long double>(failures);
  long double term = std::exp(std::lgamma(n + 1) - std::lgamma(k0 + 1) - std::lgamma(n - k0 + 1) +
                              k0 * std::log(probability) + (n - k0) * std::log1p(-probability));
  long double sum = 0;
  for (long double k = k0; k <= n; ++k) {
    sum += term;
    term *= odds * (n - k) / (k + 1);
  }
  return sum;
}

}  // namespace statistics
