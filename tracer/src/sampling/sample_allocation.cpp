#include "tracer/src/sampling/sample_allocation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr double growth_max = 8, any_growth = std::numeric_limits<double>::infinity();
/// Two samples of an audit mirrored in the pixel's centre take the slope of the image out of their half.
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

/// Pixels that have equally many samples and, within a sixteenth of an octave, want equally many.
struct Alike {
  std::int32_t wants = 0;  ///< see Planner::wants
  std::uint32_t has = 0;   ///< samples each
  double variance = 0;     ///< sums over the pixels
  double cost = 0;
};

class Planner {
 public:
  Planner(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits)
      : pixels_(pixels), range_(limits), wants_(pixels.size()) {
    std::vector<Alike> all(static_cast<std::size_t>(2 * wants_most + 1) * counts);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::uint32_t has = pixels[i].count();
      wants_[i] = wants(pixels[i].variance / cost[i], has);
      const auto power = std::min(counts, static_cast<std::uint32_t>(std::bit_width(has))) - 1;
      Alike& alike = all[static_cast<std::size_t>(wants_[i] + wants_most) * counts + power];
      alike.wants = wants_[i];
      alike.has = has;
      alike.variance += pixels[i].variance;
      alike.cost += cost[i];
    }
    std::copy_if(all.begin(), all.end(), std::back_inserter(alike_), [](const Alike& one) { return one.has > 0; });
  }

  /// Samples in each half, where lowering the squared error by 2^(`worth` / fineness) is worth a unit of cost and a
  /// pixel's samples may grow by `growth`; 0: those it has are enough.
  [[nodiscard]] std::uint32_t half(std::size_t index, std::int32_t worth, double growth) const {
    return half_of(wants_[index], pixels_[index].count(), worth, growth);
  }

  /// The highest worth that reaches the goal, but not beyond its cost.
  [[nodiscard]] std::int32_t worth_for(const AllocationGoal& goal) const {
    std::int32_t cheap = worth_most, dear = -worth_most;  // dear: samples for everything
    while (cheap - dear > 1) {
      const std::int32_t middle = (cheap + dear) / 2;
      const AllocationGoal then = outcome(middle);
      (then.squared_error <= goal.squared_error || then.cost > goal.cost ? dear : cheap) = middle;
    }
    return outcome(dear).cost > goal.cost ? cheap : dear;
  }

 private:
  static constexpr std::int32_t fineness = 16;  ///< steps an octave
  static constexpr std::int32_t wants_most = 24 * fineness, worth_most = 200 * fineness;
  static constexpr std::uint32_t counts = 20;  ///< octaves of them that are told apart

  /// The logarithm of how many samples the pixel wants where the worth is one, in steps.
  static std::int32_t wants(double variance_over_cost, std::uint32_t has) {
    if (!(variance_over_cost > 0)) return -wants_most;
    const float log2_of_one = std::log2(static_cast<float>(variance_power * variance_of_one(variance_over_cost, has)));
    const auto steps = static_cast<float>(fineness / (1 + variance_power)) * log2_of_one;
    return static_cast<std::int32_t>(std::lround(std::clamp(steps, -1.0f * wants_most, 1.0f * wants_most)));
  }

  [[nodiscard]] std::uint32_t half_of(std::int32_t wants, std::uint32_t has, std::int32_t worth, double growth) const {
    const std::uint32_t wanted = range_.nearest((wants - worth / (1 + variance_power)) / fineness);
    if (wanted <= has || wanted < 2) return 0;
    const auto grown = static_cast<std::uint32_t>(std::min(growth * has, 0x1p31));
    return std::max(std::min(wanted, grown), range_.least) / 2;
  }

  /// What is then expected to be left in the end, and what it costs.
  [[nodiscard]] AllocationGoal outcome(std::int32_t worth) const {
    AllocationGoal sum;
    for (const Alike& alike : alike_) {
      const std::uint32_t then = 2 * half_of(alike.wants, alike.has, worth, any_growth), has = alike.has;
      sum.squared_error += alike.variance * (then > has ? variance_of_one(1, has) / variance_of_one(1, then) : 1);
      sum.cost += then > has ? static_cast<double>(then - has) * alike.cost : 0;
    }
    return sum;
  }

  std::span<const PixelState> pixels_;
  Range range_;
  std::vector<std::int32_t> wants_;  ///< of each pixel
  std::vector<Alike> alike_;
};

/// Enough audits to know a mean by, few enough to cost little; small images have few pixels and so a large share.
double share_of_audits(std::size_t pilots) {
  constexpr double enough = 256;
  return std::clamp(enough / static_cast<double>(std::max<std::size_t>(1, pilots)), 1.0 / 32, 1.0 / 2);
}

}  // namespace

SampleAllocation plan_round(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                            const Adaptive& limits, std::uint32_t round, std::uint64_t seed) {
  const Planner planner(pixels, cost, limits);
  const std::int32_t worth = planner.worth_for(goal);
  SampleAllocation plan;
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
