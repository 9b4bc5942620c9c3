#include "tracer/src/accuracy/audit_choice.h"

#include <algorithm>
#include <bit>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Draws one pixel in each of `count` equal parts of the sum of all shares.
class Draws {
 public:
  Draws(std::uint64_t count, std::uint64_t key) : count_(count), key_(key), next_(place(0)) {}

  /// How often the pixel is drawn whose share of all draws comes next.
  std::uint32_t draw(double share) {
    reached_ += share;
    std::uint32_t draws = 0;
    for (; part_ < count_ && next_ < reached_; next_ = place(++part_)) ++draws;
    return draws;
  }

 private:
  [[nodiscard]] double place(std::uint64_t part) const {
    return static_cast<double>(part) + static_cast<double>(mix(key_ ^ mix(part)) >> 11) * 0x1p-53;
  }
  std::uint64_t count_, key_, part_ = 0;
  double reached_ = 0, next_;
};

constexpr std::uint32_t pilot_half = 2;

/// A quarter of its samples in each, so that to look at a pixel costs half of what it has cost.
std::uint32_t half_for(const PixelState& pixel) {
  return pixel.refined() ? std::max(pilot_half, std::bit_ceil(pixel.count()) / 4) : pilot_half;
}

/// Samples that are spent on every pixel in the mean.
double spent_on_each(std::size_t pixels) {
  constexpr double looks = 2048;
  return 2 * pilot_half * std::clamp(looks / static_cast<double>(pixels), 1.0 / 32, 1.0);
}

}  // namespace

std::vector<AuditChoice> choose_audits(std::span<const PixelState> pixels, std::uint64_t stream, std::uint64_t seed) {
  constexpr std::uint32_t draws_by_error = 256;
  double expected = 0;
  for (const PixelState& pixel : pixels) expected += pixel.refined() ? pixel.variance : 0;
  const double spent = spent_on_each(pixels.size()), by_error = expected > 0 ? draws_by_error / expected : 0;
  const std::uint64_t key = mix(mix(seed) ^ mix(~stream));
  Draws known(draws_by_error, key);
  std::vector<AuditChoice> choices;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::uint32_t half = half_for(pixels[i]);
    const double look = spent / (2 * half), error = pixels[i].refined() ? by_error * pixels[i].variance : 0;
    const bool looked = static_cast<double>(mix(mix(i) ^ key) >> 11) * 0x1p-53 < look;
    const std::uint32_t draws = known.draw(error) + (looked ? 1 : 0);
    if (draws > 0) choices.push_back({i, half, draws / (look + error)});
  }
  return choices;
}

}  // namespace tracer
