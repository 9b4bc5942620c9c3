#include "tracer/src/accuracy/plan.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr double growth_max = 8, any_growth = std::numeric_limits<double>::infinity();
/// Two samples of an audit mirrored in the pixel's centre take the slope of the picture out of their half.
constexpr std::uint32_t audit_half = 2;

/// The powers of two from `least` to `most` that are within the limits, as exponents; where none is, the even number
/// that is takes their place.
struct Range {
  std::uint32_t least = 0, most = 0;
  explicit Range(const Adaptive& limits)
      : least(std::min(std::bit_ceil(limits.samples_min), limits.samples_max & ~1u)),
        most(std::max(std::bit_floor(limits.samples_max), least)) {}
  [[nodiscard]] std::uint32_t nearest(double log2_wanted) const {
    const double rounded = std::clamp(std::round(log2_wanted), 0.0, 31.0);
    return std::clamp(1u << static_cast<std::uint32_t>(rounded), least, most);
  }
};

class Planner {
 public:
  Planner(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits)
      : pixels_(pixels), cost_(cost), range_(limits), log2_at_unit_(pixels.size()) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double of_one = variance_of_one(pixels[i].variance, pixels[i].count());
      log2_at_unit_[i] = static_cast<float>(std::log2(variance_power * of_one / cost[i]) / (1 + variance_power));
    }
    // The sums need no more than a sample of a large picture.
    stride_ = std::max<std::size_t>(1, pixels.size() / 32768);
  }

  /// Samples in each half, where lowering the squared error by 2^`log2_worth` is worth a unit of cost and a pixel's
  /// samples may grow by `growth`; 0: those it has are enough.
  [[nodiscard]] std::uint32_t half(std::size_t index, double log2_worth, double growth) const {
    const std::uint32_t has = pixels_[index].count();
    const std::uint32_t wanted = range_.nearest(log2_at_unit_[index] - log2_worth / (1 + variance_power));
    if (wanted <= has || wanted < 2) return 0;
    const auto grown = static_cast<std::uint32_t>(std::min(growth * has, 0x1p31));
    return std::max(std::min(wanted, grown), range_.least) / 2;
  }

  /// What is then expected to be left in the end, and what it costs.
  [[nodiscard]] RoundGoal outcome(double log2_worth) const {
    RoundGoal sum;
    for (std::size_t i = 0; i < pixels_.size(); i += stride_) {
      const std::uint32_t then = 2 * half(i, log2_worth, any_growth), has = pixels_[i].count();
      sum.squared_error += pixels_[i].variance * (then > has ? fallen(then) / fallen(has) : 1);
      sum.cost += then > has ? static_cast<double>(then - has) * cost_[i] : 0;
    }
    const std::size_t looked_at = (pixels_.size() + stride_ - 1) / stride_;
    const double share = static_cast<double>(pixels_.size()) / static_cast<double>(looked_at);
    return {sum.squared_error * share, sum.cost * share};
  }

  /// The highest worth that reaches the goal, but not beyond its cost; its logarithm.
  [[nodiscard]] double worth_for(const RoundGoal& goal) const {
    double cheap = 100, dear = -100;  // dear: samples for everything
    for (int step = 0; step < 24; ++step) {
      const double middle = (cheap + dear) / 2;
      const RoundGoal then = outcome(middle);
      (then.squared_error <= goal.squared_error || then.cost > goal.cost ? dear : cheap) = middle;
    }
    return outcome(dear).cost > goal.cost ? cheap : dear;
  }

 private:
  /// The part of one sample's variance that is left of the mean of `count`.
  static double fallen(std::uint32_t count) {
    static const std::array<double, 32> of_power = [] {
      std::array<double, 32> table{};
      for (std::size_t i = 0; i < table.size(); ++i) table[i] = std::exp2(-variance_power * static_cast<double>(i));
      return table;
    }();
    return of_power[static_cast<std::size_t>(std::bit_width(count) - 1)];
  }

  std::span<const PixelState> pixels_;
  std::span<const float> cost_;
  Range range_;
  std::vector<float> log2_at_unit_;  ///< of the samples wanted where a unit of cost is worth 1
  std::size_t stride_ = 1;
};

/// Enough audits to know a mean by, few enough to cost little; small pictures have few pixels and so a large share.
double share_of_audits(std::size_t pilots) {
  constexpr double enough = 1024;
  return std::clamp(enough / static_cast<double>(std::max<std::size_t>(1, pilots)), 1.0 / 32, 1.0 / 2);
}

}  // namespace

RoundPlan plan_round(std::span<PixelState> pixels, std::span<const float> cost, const RoundGoal& goal,
                     const Adaptive& limits, std::uint32_t round, std::uint64_t seed) {
  const Planner planner(pixels, cost, limits);
  const double worth = planner.worth_for(goal);
  RoundPlan plan;
  plan.half.resize(pixels.size());
  std::size_t pilots = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    plan.half[i] = planner.half(i, worth, growth_max);
    pixels[i].grows = plan.half[i] > 0;
    if (pixels[i].grows) pixels[i].role = PixelState::Role::refined;
    pilots += pixels[i].refined() ? 0 : 1;
  }
  const auto below = static_cast<std::uint64_t>(share_of_audits(pilots) * 0x1p32);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!pixels[i].refined() && (mix(mix(i ^ mix(round)) ^ mix(seed)) >> 32) < below) {
      pixels[i].role = PixelState::Role::audited;
      plan.half[i] = audit_half;
    }
    plan.empty = plan.empty && plan.half[i] == 0;
  }
  return plan;
}

}  // namespace tracer
