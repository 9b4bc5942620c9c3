#include "tracer/src/accuracy/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr double growth_max = 8, any_growth = std::numeric_limits<double>::infinity();
/// Two samples mirrored in the pixel's centre take the slope of the picture out of their half.
constexpr std::uint32_t half_min = 2;

class Planner {
 public:
  Planner(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits)
      : pixels_(pixels), cost_(cost), limits_(limits) {
    // The sums need no more than a sample of a large picture.
    stride_ = std::max<std::size_t>(1, pixels.size() / 65536);
  }

  /// In each half, where one more sample is worth `worth` squared levels per unit of cost, and a pixel's samples may
  /// grow by `growth`.
  [[nodiscard]] std::uint32_t half(std::size_t index, double worth, double growth) const {
    const PixelState& pixel = pixels_[index];
    const double per_sample = static_cast<double>(pixel.variance) * std::max(1u, pixel.count);
    double wanted = std::sqrt(per_sample / (worth * cost_[index]));
    // What would not even grow by half is left as it is: two fresh halves would cost as much as they bring.
    if (!(wanted >= 1.5 * pixel.count)) wanted = 0;
    wanted = std::clamp(wanted, static_cast<double>(limits_.samples_min), static_cast<double>(limits_.samples_max));
    wanted = std::min(wanted, growth * std::max(1u, pixel.count));
    if (!(wanted > pixel.count)) return 0;
    const auto more = static_cast<std::uint32_t>(std::ceil((wanted - pixel.count) / 2));
    const std::uint32_t room = (limits_.samples_max - pixel.count) / 2;
    return std::min(std::max(more, half_min), room);
  }

  /// What is then expected to be left in the end, and what it costs.
  [[nodiscard]] RoundGoal outcome(double worth) const {
    RoundGoal sum;
    for (std::size_t i = 0; i < pixels_.size(); i += stride_) {
      const std::uint32_t fresh = 2 * half(i, worth, any_growth);
      const double count = std::max(1u, pixels_[i].count);
      sum.squared_error += pixels_[i].variance * count / (count + fresh);
      sum.cost += static_cast<double>(fresh) * cost_[i];
    }
    const double share =
        static_cast<double>(pixels_.size()) / static_cast<double>((pixels_.size() + stride_ - 1) / stride_);
    return {sum.squared_error * share, sum.cost * share};
  }

  /// The highest worth that reaches the goal, but not beyond its cost.
  [[nodiscard]] double worth_for(const RoundGoal& goal) const {
    double cheap = 0x1p100, dear = 0x1p-100;  // dear: samples for everything
    for (int step = 0; step < 48; ++step) {
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
double share_of_audits(std::size_t never_refined) {
  constexpr double enough = 1024;
  return std::clamp(enough / static_cast<double>(std::max<std::size_t>(1, never_refined)), 1.0 / 32, 1.0 / 4);
}

}  // namespace

RoundPlan plan_round(std::span<PixelState> pixels, std::span<const float> cost, const RoundGoal& goal,
                     const Adaptive& limits, std::uint32_t round, std::uint64_t seed) {
  const Planner planner(pixels, cost, limits);
  const double worth = planner.worth_for(goal);
  RoundPlan plan;
  plan.half.resize(pixels.size());
  std::size_t never_refined = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    plan.half[i] = planner.half(i, worth, growth_max);
    if (plan.half[i] > 0) pixels[i].role = PixelState::Role::refined;
    never_refined += plan.half[i] == 0 && !pixels[i].refined_before ? 1 : 0;
  }
  const auto below = static_cast<std::uint64_t>(share_of_audits(never_refined) * 0x1p32);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (plan.half[i] == 0 && !pixels[i].refined_before && (mix(mix(i ^ mix(round)) ^ mix(seed)) >> 32) < below) {
      pixels[i].role = PixelState::Role::audited;
      plan.half[i] = half_min;
    }
    plan.samples += 2 * plan.half[i];
  }
  return plan;
}

}  // namespace tracer
