#include "tracer/src/sampling/looks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Part of the looks that is drawn by the bounds. The rest follows predictions, which raises the proven bound by 4/3.
constexpr double bound_share = 0.75;
/// Edges are drawn more often than their bounds alone would have it: more can hide there.
constexpr double edge_weight = 4;

double bound_weight(const PixelState& pixel) { return pixel.bound * (pixel.edge ? edge_weight : 1); }

/// A uniform number in [0, 1).
double uniform(std::size_t i, std::uint64_t key) { return static_cast<double>(mix(key ^ mix(i)) >> 11) * 0x1p-53; }

/// `count` uniform numbers in [0, 1), ascending.
std::vector<double> sorted_positions(std::size_t count, std::uint64_t key) {
  std::vector<double> positions(count);
  for (std::size_t i = 0; i < count; ++i) positions[i] = uniform(i, key);
  std::sort(positions.begin(), positions.end());
  return positions;
}

/// The same, `count` points after the `first` of a sequence, of which any number is stratified: neighboring places, of
/// similar errors, are drawn as often as expected.
std::vector<double> stratified_positions(std::size_t first, std::size_t count, std::uint64_t key) {
  std::vector<double> positions(count);
  for (std::size_t i = 0; i < count; ++i) positions[i] = sequence_point(static_cast<std::uint32_t>(first + i), key).x;
  std::sort(positions.begin(), positions.end());
  return positions;
}

/// Draws places with probability `share(place)`, whose sum is 1 up to rounding: `use(place)` for each of `positions`,
/// which ascend.
template <class Share, class Use>
void draw(std::size_t places, std::span<const double> positions, const Share& share, const Use& use) {
  std::size_t next = 0;
  double sum = 0;
  for (std::size_t place = 0; place < places && next < positions.size(); ++place)
    for (sum += share(place); next < positions.size() && positions[next] < sum; ++next) use(place);
}

/// Mean error that `count` looks without a find leave, relative to the sum of the bounds (Laplace's rule of
/// succession), less what `enough` looks leave.
double unseen_share(double count, double enough) { return std::max(0.0, 1 / (count + 2) - 1 / (enough + 2)); }

std::uint64_t key_of(std::uint64_t stream, std::uint64_t seed) { return mix(mix(seed) ^ mix(~stream)); }

}  // namespace

LookDraws draw_looks(std::span<PixelState> pixels, std::size_t count, std::uint64_t stream, std::uint64_t seed) {
  double bounds = 0, predictions = 0;
  for (const PixelState& pixel : pixels) {
    if (!pixel.open()) continue;
    bounds += bound_weight(pixel);
    predictions += pixel.variance;
  }
  LookDraws draws;
  if (!(bounds > 0)) return draws;
  const double by_bound = (predictions > 0 ? bound_share : 1) / bounds,
               by_prediction = predictions > 0 ? (1 - bound_share) / predictions : 0;
  draws.range = bounds / bound_share;
  const auto share = [&](std::size_t place) {
    const PixelState& pixel = pixels[place];
    return pixel.open() ? by_bound * bound_weight(pixel) + by_prediction * pixel.variance : 0;
  };
  draw(pixels.size(), sorted_positions(count, key_of(stream, seed)), share, [&](std::size_t place) {
    draws.looks.push_back({static_cast<std::uint32_t>(place), pixels[place].looks, 1 / share(place)});
    ++pixels[place].looks;
  });
  return draws;
}

LookDraws draw_looks(std::span<const float> bounds, std::size_t count, std::size_t first, std::uint64_t seed) {
  double sum = 0;
  for (const float bound : bounds) sum += bound;
  LookDraws draws{.looks = {}, .range = sum};
  if (!(sum > 0)) return draws;
  const auto share = [&](std::size_t place) { return bounds[place] / sum; };
  draw(bounds.size(), stratified_positions(first, count, key_of(0, seed)), share, [&](std::size_t place) {
    const bool again = !draws.looks.empty() && draws.looks.back().place == place;
    draws.looks.push_back(
        {static_cast<std::uint32_t>(place), again ? draws.looks.back().index + 1 : 0, 1 / share(place)});
  });
  return draws;
}

void LookPool::add(const LookDraws& draws, std::span<const FreshError> errors) {
  range_ = std::max(range_, draws.range);
  for (std::size_t i = 0; i < draws.looks.size(); ++i) {
    looks_.push_back(draws.looks[i]);
    errors_.push_back({draws.looks[i].place, errors[i].squared});
    sequence_.add(errors[i].bounded * draws.looks[i].weight / draws.range);
  }
}

void LookPool::begin_epoch() {
  if (sequence_.count() == 0) return;
  alpha_ /= 2;
  sequence_ = ConfidenceSequence(alpha_);
  range_ = 0;
}

double unseen_error(std::size_t looks, double bounds, double found, std::size_t enough) {
  const auto count = static_cast<double>(looks);
  // The number of finds, if each were as large as the bounds allow: the more has been found, the less is unseen.
  const double finds = bounds > 0 ? std::max(0.0, found) * count / bounds : 0;
  return bounds * unseen_share(count, static_cast<double>(enough)) * std::max(0.0, 1 - finds);
}

EstimatedSum SummedLooks::estimate(std::size_t looks, double bounds) const {
  const auto count = static_cast<double>(looks);
  const double unseen = unseen_error(looks, bounds, looks > 0 ? sum_ / count : 0);
  if (looks == 0) return {.squared = unseen, .variance = 0, .unseen = unseen};
  // The largest error counts once more: a few finds do not show how much larger others are.
  const double mean = sum_ / count;
  return {.squared = mean + unseen,
          .variance = (squares_ + largest_ * largest_ - count * mean * mean) / (count * count),
          .unseen = unseen};
}

EstimatedSum LookPool::estimate(std::span<const PixelState> pixels) const {
  double bounds = 0, predictions = 0;
  if (looks_.size() < looks_min) {  // else the estimate does not depend on them
    for (const PixelState& pixel : pixels) {
      if (!pixel.open()) continue;
      bounds += pixel.bound;
      predictions += pixel.variance;
    }
  }
  SummedLooks sum;
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    const PixelState& pixel = pixels[looks_[i].place];
    if (pixel.open() || pixel.repaired) sum.add(errors_[i].squared_error * looks_[i].weight);
  }
  EstimatedSum estimate = sum.estimate(looks_.size(), bounds);
  if (looks_.empty()) estimate.squared += predictions;
  return estimate;
}

double LookPool::proven() const {
  return sequence_.count() > 0 ? sequence_.upper_bound() * range_ : std::numeric_limits<double>::infinity();
}

}  // namespace tracer
