#include "tracer/src/sampling/brightest_pixel.h"

#include <algorithm>

#include "tracer/src/display/display_transform.h"

namespace tracer {
namespace {

struct Sum {
  double value = 0;
  void add(const Sum& part) { value += part.value; }
};

}  // namespace

double tone_error(std::span<const float> rgb, const Output& output, const BrightestRange& range,
                  const InParallel& in_parallel) {
  if (output.overflow != Output::Overflow::scale) return 0;
  const DisplayTransform shown(output, range.found);
  double largest = 0;
  for (const double brightest : {range.low, range.high}) {
    const DisplayTransform other(output, brightest);
    constexpr std::size_t block = 1 << 15;
    const auto add_block = [&](std::uint64_t index, Sum& sum) {
      for (const float value : rgb.subspan(index * block, std::min(block, rgb.size() - index * block))) {
        const double possible = brightest > 0 ? std::min<double>(value, brightest) : value;
        const double difference = shown.level(possible) - other.level(possible);
        sum.value += difference * difference;
      }
    };
    largest = std::max(largest, sum_in_parallel<Sum>(in_parallel, (rgb.size() + block - 1) / block, add_block).value);
  }
  return largest;
}

/// A pilot may show the brightest thing of which its neighbors have a part, and a feature may be as bright as anything.
BrightestPixels::Pixel BrightestPixels::pixel(std::size_t place) const {
  const double own = max_component(film_.mean(place));
  const auto known = known_.find(place);
  if (known != known_.end()) {
    // Two halves may agree by chance; among many pixels those are selected that do.
    constexpr double prior_sets = 2;
    const auto& [count, sets, squared, mean] = known->second;
    const double expected = sum_ / sets_ / count, value = max_component(mean);
    const double variance = (sets * squared + prior_sets * expected) / (sets + prior_sets),
                 deviation = std::sqrt(noisy_ ? std::max(variance, expected) : variance);
    return {value, deviation, std::max(value + BrightestRange::deviations * deviation, missed(place, count))};
  }
  const std::size_t width = film_.width(), x = place % width, y = place / width;
  double high = own, low = own;
  for (std::size_t row = y - std::min<std::size_t>(y, 1); row <= std::min<std::size_t>(y + 1, film_.height() - 1);
       ++row)
    for (std::size_t column = x - std::min<std::size_t>(x, 1); column <= std::min(x + 1, width - 1); ++column) {
      const double other = max_component(film_.mean(row * width + column));
      high = std::max(high, other);
      low = std::min(low, other);
    }
  const bool smooth = !noisy_ && high - low < 0.02 * high;
  return {own, smooth ? 0 : high - low, std::max(smooth ? own : high, missed(place, 0))};
}

BrightestRange BrightestPixels::range() const {
  BrightestRange range;
  // Each pixel may be left with the samples of any step, if these have made it dark or bright by chance.
  const double values = steps_max * std::max(1.0, static_cast<double>(known_.size())),
               deviations = BrightestRange::deviations_of_largest(values);
  for (std::size_t place = 0; place < film_.size(); ++place) {
    const Pixel one = pixel(place);
    range.found = std::max(range.found, max_component(film_.mean(place)));
    range.high = std::max(range.high, std::isfinite(one.high) ? one.high : one.value);
    // Unless there are samples of the pixel alone, all that is bright in it may be chance.
    if (!noisy_ || known_.contains(place)) range.low = std::max(range.low, one.value - deviations * one.deviation);
  }
  return range;
}

std::vector<std::pair<std::size_t, std::uint32_t>> BrightestPixels::next(double tolerance,
                                                                         std::uint32_t samples_max) const {
  constexpr std::size_t pixels_max = 1 << 14;
  constexpr std::uint32_t first = 16;
  const BrightestRange all = range();
  std::vector<std::pair<std::size_t, std::uint32_t>> samples;
  for (std::size_t place = 0; place < film_.size(); ++place) {
    const Pixel one = pixel(place);
    if (!(one.high > all.low) || !(std::min(one.high, 2 * all.high) - one.value > tolerance * all.found ||
                                   one.deviation > tolerance * all.found))
      continue;
    const auto known = known_.find(place);
    const double count = known == known_.end() ? 0 : known->second.count;
    const std::uint32_t wanted = count == 0 ? (missed(place, 0) > all.low ? feature_samples : first)
                                            : static_cast<std::uint32_t>(count),
                        most = (samples_max - std::min(samples_max, static_cast<std::uint32_t>(count))) & ~1u;
    if (most > 0) samples.emplace_back(place, std::min(wanted, most));
  }
  std::ranges::sort(samples, [&](const auto& a, const auto& b) { return pixel(a.first).high > pixel(b.first).high; });
  samples.resize(std::min(samples.size(), pixels_max));
  return samples;
}

void BrightestPixels::add(std::size_t place, const SetSums& sums) {
  if (sums.count[0] == 0 || sums.count[1] == 0) return;
  Known& known = known_[place];
  const double n = sums.count[0] + sums.count[1], share = n / (known.count + n);
  double squared = 0;
  for (const auto channel : {&Color::r, &Color::g, &Color::b})
    squared = std::max(squared, std::pow((sums.mean[0].*channel - sums.mean[1].*channel) / 2, 2));
  known.squared_deviation = (1 - share) * (1 - share) * known.squared_deviation + share * share * squared;
  sum_ += n * squared;
  ++sets_;
  known.mean = known.mean * (1 - share) + (sums.mean[0] * sums.count[0] + sums.mean[1] * sums.count[1]) * (share / n);
  known.count += n;
  ++known.sets;
}

}  // namespace tracer
