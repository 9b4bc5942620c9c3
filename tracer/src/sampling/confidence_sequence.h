#pragma once
/// Upper confidence bound of a mean that is valid at any number of observations and under any stopping rule.
///
/// A bound for a fixed number of observations does not hold if it is computed after each of them until it is small
/// enough. This one is a confidence sequence: with probability >= 1 - alpha, no bound of the whole sequence is below
/// the mean (Howard, Ramdas, McAuliffe and Sekhon 2021, "Time-uniform, nonparametric, nonasymptotic confidence
/// sequences", Annals of Statistics 49).
///
/// It is built by betting (Waudby-Smith and Ramdas 2024, "Estimating means of bounded random variables by betting",
/// JRSS-B 86). Let m_k be the mean of observation x_k <= 1 given all earlier ones, and m the average of m_1 ... m_n.
/// 1. For a fixed fraction f in (0, 1], 1 - f x_k is not negative and has the mean 1 - f m_k. So the wealth
///    V_f = prod (1 - f x_k) / (1 - f m_k) is a nonnegative martingale that begins with 1, and so is the mean of V_f
///    over fractions with weights that sum to 1. It reaches 1 / alpha with probability <= alpha (Ville 1939).
/// 2. log(1 - f m) is concave in m, so prod (1 - f m_k) <= (1 - f m)^n (Jensen). Hence W_f(m) <= V_f for
///    W_f(m) = prod (1 - f x_k) / (1 - f m)^n, which depends on the observations only by the sum of log(1 - f x_k).
/// 3. Every W_f, and so their weighted mean W, increases with m. The bound is the root of W(m) = 1 / alpha: it is below
///    the average m only if W(m) >= 1 / alpha, which by 1 and 2 happens at any time with probability <= alpha.
///
/// The observations need no common mean: the bound is one of the average of their means. They may depend on earlier
/// ones, as when the distribution that they are drawn from changes.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tracer {

/// Observations are <= 1: the caller divides by their upper bound and, for importance sampling, by the probability of
/// the draw. They may be negative, which the proof does not exclude: the product (X - A)(X - B) of an X and two
/// independent estimates A and B in one interval of width w lies in [-w^2 / 4, w^2]; if both have the mean R, that of
/// the product is (X - R)^2. One thread at a time.
class ConfidenceSequence {
 public:
  struct Bet {
    double fraction;  ///< f above
    double weight;    ///< part of the initial wealth; all weights sum to 1
  };
  /// Fractions 1, 3/4, 3/8, 3/16, ... The best one is about sqrt(2 log(1 / alpha) / (n variance)), and one that differs
  /// from it by a factor of sqrt(2) widens the interval by 6 %, so powers of two suffice; the last serves 10^8
  /// observations of any variance. The weights fall slowly, since a weight w costs a term log(1 / w). The largest is
  /// that of the fraction 1, which is the best while nothing is found: n zeros bound the mean by 3.3 / n at 95 %, where
  /// no bound is below 3.0 / n.
  static constexpr std::array<Bet, 13> bets = [] {
    constexpr double first_weight = 0.75;
    std::array<Bet, 13> list{};
    list[0] = {1, first_weight};
    double fraction = 0.75;
    for (std::size_t i = 1; i < list.size(); ++i, fraction /= 2) {
      const auto place = static_cast<double>(i);
      const double share = i + 1 < list.size() ? 1 / (place * (place + 1)) : 1 / place;  // telescopes to 1
      list[i] = {fraction, (1 - first_weight) * share};
    }
    return list;
  }();

  /// The confidence is 1 - `alpha`; 0 < alpha < 1.
  explicit ConfidenceSequence(double alpha) : log_alpha_(std::log(alpha)) {}

  /// Values above 1, which rounding may cause, count as 1, as do NaNs. Values below -1/4 count as -1/4: this raises the
  /// mean, so the bound remains valid.
  void add(double observation);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Average of the observations, unbiased; 0 without observations.
  [[nodiscard]] double mean() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
  /// Upper bound of the average of the means, in [0, 1]; 1 without observations.
  [[nodiscard]] double upper_bound() const;

 private:
  struct LogWealth {
    double value = 0, slope = 0;
  };
  /// Logarithm of W and its derivative. Precondition: mean < 1.
  [[nodiscard]] LogWealth log_wealth(double mean) const;

  double log_alpha_;
  std::uint64_t count_ = 0;
  double sum_ = 0;
  std::array<double, bets.size()> log_products_{};  ///< per bet: sum of log(1 - fraction * observation)
};

}  // namespace tracer
