#include "tracer/src/sampling/holdout_selection.h"

#include <algorithm>
#include <bit>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

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
