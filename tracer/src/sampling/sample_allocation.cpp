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

/// The predicted error of a pixel falls like the number of samples to this power.
double power_of(bool suspected) { return suspected ? missed_power : variance_power; }

/// Pixels with equally many samples and, within a sixteenth of an octave, equal demand.
struct PixelClass {
  std::int32_t demand = 0;  ///< see Allocator::demand
  std::uint32_t count = 0;  ///< samples per pixel
  bool suspected = false;   ///< as that of PixelState
  double variance = 0;      ///< sum over the pixels
  double cost = 0;
};

class Allocator {
 public:
  Allocator(std::span<const PixelState> pixels, std::span<const float> cost, const Adaptive& limits,
            std::uint32_t round)
      : pixels_(pixels), range_(limits), key_(mix(~std::uint64_t{round})), demand_(pixels.size()) {
    std::vector<PixelClass> all(2 * static_cast<std::size_t>(2 * demand_max + 1) * count_octaves);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::uint32_t count = pixels[i].count();
      const bool suspected = pixels[i].suspected;
      demand_[i] = demand(pixels[i].variance / cost[i], count, suspected);
      const auto octave = std::min(count_octaves, static_cast<std::uint32_t>(std::bit_width(count))) - 1;
      const std::size_t row = 2 * static_cast<std::size_t>(demand_[i] + demand_max) + (suspected ? 1 : 0);
      PixelClass& pixel_class = all[row * count_octaves + octave];
      pixel_class.demand = demand_[i];
      pixel_class.count = count;
      pixel_class.suspected = suspected;
      pixel_class.variance += pixels[i].variance;
      pixel_class.cost += cost[i];
    }
    std::copy_if(all.begin(), all.end(), std::back_inserter(classes_),
                 [](const PixelClass& one) { return one.count > 0; });
  }

  /// Samples in each half if a unit of cost must lower the squared error by 2^(`price` / steps_per_octave), and the
  /// samples of a pixel may grow by the factor `growth`; 0: no new samples. Of pixels with the same demand a part has
  /// the next lower power of two, the others the next higher one, so that the mean logarithm is optimal.
  [[nodiscard]] std::uint32_t half(std::size_t index, std::int32_t price, double growth) const {
    const PixelState& pixel = pixels_[index];
    const double threshold = static_cast<double>(mix(index ^ key_) >> 11) * 0x1p-53;
    const double log2_count = std::floor(log2_optimal(demand_[index], pixel.suspected, price) + threshold);
    return half_of(range_.nearest(log2_count), pixel.count(), growth);
  }

  /// Samples in each half of a pixel that is refined because of its bound.
  [[nodiscard]] std::uint32_t refined() const { return range_.nearest(std::log2(2.0 * refined_half)) / 2; }

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
  static std::int32_t demand(double variance_over_cost, std::uint32_t count, bool suspected) {
    if (!(variance_over_cost > 0)) return -demand_max;
    const double power = power_of(suspected), of_one = suspected ? variance_over_cost * std::pow(count, missed_power)
                                                                 : variance_of_one(variance_over_cost, count);
    const auto steps =
        static_cast<float>(steps_per_octave / (1 + power)) * std::log2(static_cast<float>(power * of_one));
    return static_cast<std::int32_t>(std::lround(std::clamp(steps, -1.0f * demand_max, 1.0f * demand_max)));
  }

  static double log2_optimal(std::int32_t demand, bool suspected, std::int32_t price) {
    return (demand - price / (1 + power_of(suspected))) / steps_per_octave;
  }

  [[nodiscard]] std::uint32_t half_of(std::uint32_t optimal, std::uint32_t count, double growth) const {
    if (optimal <= count || optimal < 2) return 0;
    const auto grown = static_cast<std::uint32_t>(std::min(growth * count, 0x1p31));
    return std::max(std::min(optimal, grown), range_.least) / 2;
  }

  /// Predicted error and cost after all rounds.
  [[nodiscard]] AllocationGoal outcome(std::int32_t price) const {
    AllocationGoal sum;
    for (const PixelClass& pixel_class : classes_) {
      const double log2_count = log2_optimal(pixel_class.demand, pixel_class.suspected, price);
      const double lower = std::floor(log2_count), share = log2_count - lower;
      add(pixel_class, range_.nearest(lower), 1 - share, sum);
      add(pixel_class, range_.nearest(lower + 1), share, sum);
    }
    return sum;
  }

  /// Adds a part of the pixels of a class.
  void add(const PixelClass& pixel_class, std::uint32_t optimal, double share, AllocationGoal& sum) const {
    const std::uint32_t count = pixel_class.count, then = 2 * half_of(optimal, count, any_growth);
    const double lower =
        then > count ? std::pow(static_cast<double>(count) / then, power_of(pixel_class.suspected)) : 1;
    sum.squared_error += share * pixel_class.variance * lower;
    sum.cost += then > count ? share * static_cast<double>(then - count) * pixel_class.cost : 0;
  }

  std::span<const PixelState> pixels_;
  Range range_;
  std::uint64_t key_;
  std::vector<std::int32_t> demand_;  ///< by pixel
  std::vector<PixelClass> classes_;
};

/// Bound of an open pixel as it counts for AllocationGoal::bound_max; 0 for others.
double risk_of(const PixelState& pixel) {
  constexpr double silent_edge = 64, quiet = 1e-3;
  if (!pixel.open()) return 0;
  return pixel.bound * (pixel.edge && predicted_variance(pixel.contrast) < quiet * pixel.bound ? silent_edge : 1);
}

/// Selects the open pixels that are always refined, so that they cost at most half of the limit: those
/// with the largest bounds, and a scattered part of those with bounds within a factor of two below.
class UnsafePixels {
 public:
  UnsafePixels(std::span<const PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal)
      : pixels_(pixels), bound_(goal.bound_max) {
    double left = 0, sum = cost_above(bound_, cost);
    for (; sum > goal.cost / 2; bound_ *= 2, sum = left) {
      left = cost_above(2 * bound_, cost);
      share_ = std::clamp((goal.cost / 2 - left) / (sum - left), 0.0, 1.0);
    }
  }
  [[nodiscard]] bool contains(std::size_t i) const {
    const double risk = risk_of(pixels_[i]);
    return risk > bound_ || (risk > bound_ / 2 && static_cast<double>(mix(i) >> 11) * 0x1p-53 < share_);
  }

 private:
  [[nodiscard]] double cost_above(double bound, std::span<const float> cost) const {
    double sum = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      if (risk_of(pixels_[i]) > bound) sum += 2.0 * refined_half * cost[i];
    return sum;
  }

  std::span<const PixelState> pixels_;
  double bound_, share_ = 0;
};

}  // namespace

SampleAllocation allocate_samples(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                                  const Adaptive& limits) {
  const Allocator allocator(pixels, cost, limits, goal.round);
  const std::int32_t price = allocator.price_for(goal);
  const UnsafePixels unsafe(pixels, cost, goal);
  SampleAllocation allocation;
  allocation.half.resize(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    allocation.half[i] = std::max(allocator.half(i, price, growth_max), unsafe.contains(i) ? allocator.refined() : 0);
    if (allocation.half[i] == 0) continue;
    pixels[i].role = PixelState::Role::refined;
    allocation.empty = false;
  }
  return allocation;
}

void raise_in_tiles(std::span<PixelState> pixels, std::uint32_t width, std::span<const ExcessTile> tiles,
                    const Adaptive& limits, SampleAllocation& allocation) {
  const Range range(limits);
  for (const auto& [window, excess] : tiles) {
    double sum = 0;
    for (std::uint32_t y = window.y0; y < window.y1; ++y)
      for (std::uint32_t x = window.x0; x < window.x1; ++x) sum += pixels[std::size_t{y} * width + x].variance;
    const double mean = sum / static_cast<double>(window.pixels());
    const double growth = std::clamp(std::pow(excess, 1 / variance_power), 2.0, growth_max);
    for (std::uint32_t y = window.y0; y < window.y1; ++y) {
      for (std::uint32_t x = window.x0; x < window.x1; ++x) {
        const std::size_t place = std::size_t{y} * width + x;
        PixelState& pixel = pixels[place];
        const std::uint32_t wanted = range.nearest(std::log2(growth * pixel.count()));
        if (!(pixel.variance > mean / excess) || wanted <= std::max(pixel.count(), 2 * allocation.half[place]))
          continue;
        allocation.half[place] = wanted / 2;
        pixel.role = PixelState::Role::refined;
        allocation.empty = false;
      }
    }
  }
}

bool at_maximum(std::span<const PixelState> pixels, const Adaptive& limits) {
  double all = 0, free = 0;
  for (const PixelState& pixel : pixels) {
    all += pixel.variance;
    free += 2 * pixel.count() <= limits.samples_max ? pixel.variance : 0;
  }
  return 2 * free < all;
}

bool any_unsafe(std::span<const PixelState> pixels, double bound_max) {
  return std::ranges::any_of(pixels, [&](const PixelState& pixel) { return risk_of(pixel) > bound_max; });
}

void withdraw_without_samples(std::span<PixelState> pixels) {
  for (PixelState& pixel : pixels)
    if (pixel.refined() && !pixel.begun()) pixel.role = PixelState::Role::pilot;
}

}  // namespace tracer
