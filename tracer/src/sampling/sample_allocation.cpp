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
/// Two mirrored samples, so that the slope of the image cancels in each half.
constexpr std::uint32_t holdout_half = 2;

/// Powers of two within the limits; if there is none, the even number within the limits.
struct Range {
  std::uint32_t least = 0, most = 0;
  explicit Range(const Adaptive& limits)
      : least(std::min(std::bit_ceil(limits.samples_min), limits.samples_max & ~1u)),
        most(std::max(std::bit_floor(limits.samples_max), least)) {}
  [[nodiscard]] std::uint32_t nearest(double log2_count) const {
    const double rounded = std::clamp(std::round(log2_count), 0.0, 31.0);
    return std::clamp(1u << static_cast<std::uint32_t>(rounded), least, most);
  }
};

/// Pixels with equally many samples and, within a sixteenth of an octave, equal demand.
struct PixelClass {
  std::int32_t demand = 0;  ///< see Allocator::demand
  std::uint32_t count = 0;  ///< samples per pixel
  double variance = 0;      ///< sum over the pixels
  double cost = 0;
};

class Allocator {
 public:
  Allocator(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits)
      : pixels_(pixels), range_(limits), demand_(pixels.size()) {
    std::vector<PixelClass> all(static_cast<std::size_t>(2 * demand_max + 1) * count_octaves);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::uint32_t count = pixels[i].count();
      demand_[i] = demand(pixels[i].variance / cost[i], count);
      const auto power = std::min(count_octaves, static_cast<std::uint32_t>(std::bit_width(count))) - 1;
      PixelClass& pixel_class = all[static_cast<std::size_t>(demand_[i] + demand_max) * count_octaves + power];
      pixel_class.demand = demand_[i];
      pixel_class.count = count;
      pixel_class.variance += pixels[i].variance;
      pixel_class.cost += cost[i];
    }
    std::copy_if(all.begin(), all.end(), std::back_inserter(classes_),
                 [](const PixelClass& one) { return one.count > 0; });
  }

  /// Samples in each half if a unit of cost must lower the squared error by 2^(`price` / steps_per_octave), and the
  /// samples of a pixel may grow by the factor `growth`; 0: no new samples.
  [[nodiscard]] std::uint32_t half(std::size_t index, std::int32_t price, double growth) const {
    return half_of(demand_[index], pixels_[index].count(), price, growth);
  }

  /// The highest price that reaches the goal within its cost.
  [[nodiscard]] std::int32_t price_for(const AllocationGoal& goal) const {
    std::int32_t few = price_max, many = -price_max;  // prices that allocate few and many samples
    while (few - many > 1) {
      const std::int32_t middle = (few + many) / 2;
      const AllocationGoal then = outcome(middle);
      (then.squared_error <= goal.squared_error || then.cost > goal.cost ? many : few) = middle;
    }
    return outcome(many).cost > goal.cost ? few : many;
  }

 private:
  static constexpr std::int32_t steps_per_octave = 16;
  static constexpr std::int32_t demand_max = 24 * steps_per_octave, price_max = 200 * steps_per_octave;
  static constexpr std::uint32_t count_octaves = 20;  ///< octaves of the number of samples

  /// Logarithm of the number of samples that is optimal at price 0, in steps.
  static std::int32_t demand(double variance_over_cost, std::uint32_t count) {
    if (!(variance_over_cost > 0)) return -demand_max;
    const float log2_of_one =
        std::log2(static_cast<float>(variance_power * variance_of_one(variance_over_cost, count)));
    const auto steps = static_cast<float>(steps_per_octave / (1 + variance_power)) * log2_of_one;
    return static_cast<std::int32_t>(std::lround(std::clamp(steps, -1.0f * demand_max, 1.0f * demand_max)));
  }

  [[nodiscard]] std::uint32_t half_of(std::int32_t demand, std::uint32_t count, std::int32_t price,
                                      double growth) const {
    const std::uint32_t optimal = range_.nearest((demand - price / (1 + variance_power)) / steps_per_octave);
    if (optimal <= count || optimal < 2) return 0;
    const auto grown = static_cast<std::uint32_t>(std::min(growth * count, 0x1p31));
    return std::max(std::min(optimal, grown), range_.least) / 2;
  }

  /// Predicted error and cost after all rounds.
  [[nodiscard]] AllocationGoal outcome(std::int32_t price) const {
    AllocationGoal sum;
    for (const PixelClass& pixel_class : classes_) {
      const std::uint32_t then = 2 * half_of(pixel_class.demand, pixel_class.count, price, any_growth),
                          count = pixel_class.count;
      sum.squared_error +=
          pixel_class.variance * (then > count ? variance_of_one(1, count) / variance_of_one(1, then) : 1);
      sum.cost += then > count ? static_cast<double>(then - count) * pixel_class.cost : 0;
    }
    return sum;
  }

  std::span<const PixelState> pixels_;
  Range range_;
  std::vector<std::int32_t> demand_;  ///< by pixel
  std::vector<PixelClass> classes_;
};

/// Fraction of the pilots selected for holdout: enough for a mean, and cheap. Small images need a larger fraction.
double holdout_fraction(std::size_t pilots) {
  constexpr double count = 256;
  return std::clamp(count / static_cast<double>(std::max<std::size_t>(1, pilots)), 1.0 / 32, 1.0 / 2);
}

double random(std::uint64_t key, std::uint64_t index) {
  return static_cast<double>(mix(key ^ mix(index)) >> 11) * 0x1p-53;
}

/// Draws one pixel in each of `count` equal strata of the sum of all shares.
class StratifiedDraws {
 public:
  StratifiedDraws(std::uint64_t count, std::uint64_t key) : count_(count), key_(key), next_(position(0)) {}

  /// Number of draws of the next pixel, whose expected number is `share`.
  std::uint32_t draw(double share) {
    sum_ += share;
    std::uint32_t draws = 0;
    for (; stratum_ < count_ && next_ < sum_; next_ = position(++stratum_)) ++draws;
    return draws;
  }

 private:
  [[nodiscard]] double position(std::uint64_t stratum) const {
    return static_cast<double>(stratum) + random(key_, stratum);
  }
  std::uint64_t count_, key_, stratum_ = 0;
  double sum_ = 0, next_;
};

constexpr std::uint32_t pilot_half = 2;

/// A quarter of the pixel's samples in each half, so that validation costs half as much as the pixel did.
std::uint32_t half_for(const PixelState& pixel) {
  return pixel.refined() ? std::max(pilot_half, std::bit_ceil(pixel.count()) / 4) : pilot_half;
}

}  // namespace

SampleAllocation allocate_samples(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                                  const Adaptive& limits, std::uint32_t round, std::uint64_t seed) {
  const Allocator allocator(pixels, cost, limits);
  const std::int32_t price = allocator.price_for(goal);
  SampleAllocation allocation;
  allocation.half.resize(pixels.size());
  std::size_t pilots = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    allocation.half[i] = allocator.half(i, price, growth_max);
    pixels[i].grows = allocation.half[i] > 0;
    if (pixels[i].grows) pixels[i].role = PixelState::Role::refined;
    pilots += pixels[i].refined() ? 0 : 1;
  }
  const auto below = static_cast<std::uint64_t>(holdout_fraction(pilots) * 0x1p32);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!pixels[i].refined() && (mix(mix(i ^ mix(round)) ^ mix(seed)) >> 32) < below) {
      pixels[i].role = PixelState::Role::holdout;
      allocation.half[i] = holdout_half;
    }
    allocation.empty = allocation.empty && allocation.half[i] == 0;
  }
  return allocation;
}

HoldoutBudget full_holdout_budget(std::size_t pixels) {
  return {.pixels = std::max(2048.0, static_cast<double>(pixels) / 32)};
}

HoldoutBudget holdout_budget_within(std::span<const PixelState> pixels, double samples_max) {
  constexpr double pixels_min = 64;
  constexpr std::uint32_t draws_min = 16;
  HoldoutBudget budget = full_holdout_budget(pixels.size());
  double predicted = 0, samples = 0;
  for (const PixelState& pixel : pixels) {
    if (!pixel.refined()) continue;
    predicted += pixel.variance;
    samples += double{pixel.variance} * 2 * half_for(pixel);
  }
  const double cost = 2 * pilot_half * budget.pixels + (predicted > 0 ? budget.draws * samples / predicted : 0);
  const double factor = std::min(1.0, samples_max / cost);
  budget.pixels = std::max(pixels_min, budget.pixels * factor);
  budget.draws = std::max(draws_min, static_cast<std::uint32_t>(budget.draws * factor));
  return budget;
}

std::vector<HoldoutPixel> select_holdout_pixels(std::span<const PixelState> pixels, const HoldoutBudget& budget,
                                                std::uint64_t stream, std::uint64_t seed) {
  double predicted = 0;
  for (const PixelState& pixel : pixels) predicted += pixel.refined() ? pixel.variance : 0;
  const double by_error = predicted > 0 ? budget.draws / predicted : 0;
  const double spent = 2 * pilot_half * std::min(1.0, budget.pixels / static_cast<double>(pixels.size()));
  const std::uint64_t key = mix(mix(seed) ^ mix(~stream));
  StratifiedDraws predictions(budget.draws, key);
  std::vector<HoldoutPixel> selected;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::uint32_t half = half_for(pixels[i]);
    const double probability = spent / (2 * half), error = pixels[i].refined() ? by_error * pixels[i].variance : 0;
    const std::uint32_t draws = predictions.draw(error) + (random(~key, i) < probability ? 1 : 0);
    if (draws > 0) selected.push_back({i, half, draws / (probability + error)});
  }
  return selected;
}

std::vector<HoldoutPixel> select_holdout_pixels(std::size_t pixels, std::size_t count, std::uint64_t stream,
                                                std::uint64_t seed) {
  const std::uint64_t key = mix(mix(seed) ^ mix(~stream));
  const std::size_t draws = std::min(pixels, count);
  const double each = static_cast<double>(pixels) / static_cast<double>(draws);
  std::vector<HoldoutPixel> selected;
  for (std::size_t stratum = 0; stratum < draws; ++stratum) {
    const double at = (static_cast<double>(stratum) + random(key, stratum)) * each;
    const std::size_t place = std::min(pixels - 1, static_cast<std::size_t>(at));
    if (!selected.empty() && selected.back().place == place) {
      selected.back().stands_for += each;
    } else {
      selected.push_back({place, pilot_half, each});
    }
  }
  return selected;
}

}  // namespace tracer
