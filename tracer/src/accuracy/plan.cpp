#include "tracer/src/accuracy/plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr double growth_max = 8, any_growth = std::numeric_limits<double>::infinity();
/// Two samples of an audit mirrored in the pixel's centre take the slope of the picture out of their half.
constexpr std::uint32_t audit_half = 2;

class Planner {
 public:
  Planner(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits)
      : pixels_(pixels), cost_(cost), limits_(limits) {
    // The sums need no more than a sample of a large picture.
    stride_ = std::max<std::size_t>(1, pixels.size() / 65536);
  }

  /// Samples in each half, where lowering the squared error by `worth` is worth a unit of cost and a pixel's samples
  /// may grow by `growth`; 0: those it has are enough.
  [[nodiscard]] std::uint32_t half(std::size_t index, double worth, double growth) const {
    const PixelState& pixel = pixels_[index];
    const std::uint32_t has = pixel.refined() ? pixel.count() : 1;
    const double of_one = variance_of_one(pixel.variance, has);
    double wanted = std::pow(variance_power * of_one / (worth * cost_[index]), 1 / (1 + variance_power));
    wanted = std::clamp(wanted, static_cast<double>(limits_.samples_min), static_cast<double>(limits_.samples_max));
    wanted = std::min(wanted, growth * has);
    // To the nearest power of two on a logarithmic scale, but no fewer than asked for, and no more.
    auto rounded = static_cast<std::uint32_t>(std::exp2(std::round(std::log2(wanted))));
    if (rounded < limits_.samples_min) rounded = std::bit_ceil(limits_.samples_min);
    if (rounded > limits_.samples_max) rounded = limits_.samples_max;
    return rounded > has && rounded >= 2 ? rounded / 2 : 0;
  }

  /// What is then expected to be left in the end, and what it costs.
  [[nodiscard]] RoundGoal outcome(double worth) const {
    RoundGoal sum;
    for (std::size_t i = 0; i < pixels_.size(); i += stride_) {
      const std::uint32_t then = 2 * half(i, worth, any_growth), has = pixels_[i].count();
      const double variance = pixels_[i].variance;
      sum.squared_error += then > has ? variance_of_one(variance, has) / variance_of_one(1, then) : variance;
      sum.cost += then > has ? static_cast<double>(then - has) * cost_[i] : 0;
    }
    const double share =
        static_cast<double>(pixels_.size()) / static_cast<double>((pixels_.size() + stride_ - 1) / stride_);
    return {sum.squared_error * share, sum.cost * share};
  }

  /// The highest worth that reaches the goal, but not beyond its cost.
  [[nodiscard]] double worth_for(const RoundGoal& goal) const {
    double cheap = 0x1p100, dear = 0x1p-100;  // dear: samples for everything
    for (int step = 0; step < 40; ++step) {
      const double middle = std::sqrt(cheap) * std::sqrt(dear);
      const RoundGoal then = outcome(middle);
      (then.squared_error <= goal.squared_error || then.cost > goal.cost ? dear : cheap) = middle;
    }
    return outcome(dear).cost > goal.cost ? cheap : dear;
  }

 private:
  std::span<const PixelState> pixels_;
  std::span<const float> cost_;
  const Adaptive& limits_;
  std::size_t stride_ = 1;
};

/// Enough audits to know a mean by, few enough to cost little; small pictures have few pixels and so a large share.
double share_of_audits(std::size_t pilots) {
  constexpr double enough = 1024;
  return std::clamp(enough / static_cast<double>(std::max<std::size_t>(1, pilots)), 1.0 / 32, 1.0 / 4);
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
    if (plan.half[i] > 0) pixels[i].role = PixelState::Role::refined;
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
