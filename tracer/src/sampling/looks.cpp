#include "tracer/src/sampling/looks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Mean error that `count` looks without a find leave, relative to the sum of the bounds (Laplace's rule of
/// succession), less what `enough` looks leave.
double unseen_share(double count, double enough) { return std::max(0.0, 1 / (count + 2) - 1 / (enough + 2)); }

}  // namespace

LookDraws draw_looks(std::span<const float> bounds, std::size_t count, std::size_t first, std::uint64_t seed) {
  double sum = 0;
  for (const float bound : bounds) sum += bound;
  LookDraws draws{.looks = {}, .range = sum};
  if (!(sum > 0)) return draws;
  // Points of a sequence of which any number is stratified: neighboring places, of similar errors, are drawn as often
  // as expected.
  std::vector<double> positions(count);
  const std::uint64_t key = mix(mix(seed) ^ mix(~std::uint64_t{0}));
  for (std::size_t i = 0; i < count; ++i) positions[i] = sequence_point(static_cast<std::uint32_t>(first + i), key).x;
  std::sort(positions.begin(), positions.end());
  double end = 0;
  std::size_t next = 0;
  for (std::size_t place = 0; place < bounds.size() && next < count; ++place) {
    const double share = bounds[place] / sum;
    end += share;
    for (std::uint32_t again = 0; next < count && positions[next] < end; ++next)
      draws.looks.push_back({static_cast<std::uint32_t>(place), again++, 1 / share});
  }
  return draws;
}

double unseen_error(std::size_t looks, double bounds, double found, std::size_t enough) {
  const auto count = static_cast<double>(looks);
  // The number of finds, if each were as large as the bounds allow: the more has been found, the less is unseen.
  const double finds = bounds > 0 ? std::max(0.0, found) * count / bounds : 0;
  return bounds * unseen_share(count, static_cast<double>(enough)) * std::max(0.0, 1 - finds);
}

SampledError SummedLooks::estimate(std::size_t looks, double bounds) const {
  const auto count = static_cast<double>(looks);
  const double unseen = unseen_error(looks, bounds, looks > 0 ? sum_ / count : 0);
  if (looks == 0) return {unseen, unseen};
  // The largest error counts once more: a few finds do not show how much larger others are.
  const double mean = sum_ / count, squared = mean + unseen;
  const double variance = (squares_ + largest_ * largest_ - count * mean * mean) / (count * count);
  return {squared, std::max(0.0, squared + error_deviations * std::sqrt(variance))};
}

}  // namespace tracer
