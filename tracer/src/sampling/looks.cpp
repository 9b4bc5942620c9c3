#include "tracer/src/sampling/looks.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/math/sampling.h"

namespace tracer {

std::vector<Look> draw_looks(std::span<const float> bounds, std::size_t count, std::size_t first, std::uint64_t seed) {
  double sum = 0;
  for (const float bound : bounds) sum += bound;
  std::vector<Look> looks;
  if (!(sum > 0)) return looks;
  // Points of a sequence of which any number is stratified: neighboring places, of similar errors, are drawn as often
  // as expected.
  std::vector<double> positions(count);
  const std::uint64_t key = mix(mix(seed) ^ mix(~std::uint64_t{0}));
  for (std::size_t i = 0; i < count; ++i) positions[i] = sequence_point(static_cast<std::uint32_t>(first + i), key).x;
  std::ranges::sort(positions);
  double end = 0;
  std::size_t next = 0;
  for (std::size_t place = 0; place < bounds.size() && next < count; ++place) {
    const double share = bounds[place] / sum;
    end += share;
    for (std::uint32_t again = 0; next < count && positions[next] < end; ++next)
      looks.push_back({static_cast<std::uint32_t>(place), again++, 1 / share});
  }
  return looks;
}

double unseen_error(std::size_t looks, double bounds, double found, std::size_t enough) {
  const auto count = static_cast<double>(looks);
  // The number of finds, if each were as large as the bounds allow: the more has been found, the less is unseen.
  const double finds = bounds > 0 ? std::max(0.0, found) * count / bounds : 0;
  const double share = std::max(0.0, 1 / (count + 2) - 1 / (static_cast<double>(enough) + 2));
  return bounds * share * std::max(0.0, 1 - finds);
}

SampledError error_of_looks(std::span<const double> errors, double bounds) {
  SummedErrors sum;
  for (const double error : errors) sum.add({error, error * error, std::abs(error)});
  const double count = std::max(1.0, static_cast<double>(errors.size())), mean = sum.squared / count;
  const double unseen = unseen_error(errors.size(), bounds, mean);
  // The largest error counts once more: a few finds do not show how much larger others are.
  const double spread = sum.spread + sum.largest * sum.largest - count * mean * mean;
  return {mean + unseen, std::max(0.0, mean + unseen + error_deviations * std::sqrt(spread) / count)};
}

SampledError truncation_error(std::span<const double> squares, double bound) {
  SampledError error = error_of_looks(squares, 0);
  const double unseen = bound * 3 / static_cast<double>(std::max<std::size_t>(1, squares.size()));
  error.squared_upper = std::min(bound, error.squared > 0 ? error.squared_upper : unseen);
  return error;
}

double squared_change(const Color& value, const Halves& added, const DisplayTransform& display) {
  double squared = 0;
  for (const double Color::*channel : {&Color::r, &Color::g, &Color::b}) {
    const double level = display.level(value.*channel);
    const auto change = [&](const Color& sample) {
      return std::isfinite(sample.*channel) ? display.level(value.*channel + sample.*channel) - level : 0;
    };
    squared += change(added[0]) * change(added[1]);
  }
  return squared;
}

}  // namespace tracer
