#include "tracer/src/sampling/tone_error.h"

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
        const double difference = shown.level(value) - other.level(value);
        sum.value += difference * difference;
      }
    };
    largest = std::max(largest, sum_in_parallel<Sum>(in_parallel, (rgb.size() + block - 1) / block, add_block).value);
  }
  return largest;
}

}  // namespace tracer
