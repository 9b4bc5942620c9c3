#include "tracer/src/sampling/holdout_selection.h"

#include <algorithm>
#include <bit>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

double chance(std::uint64_t key, std::uint64_t of) { return static_cast<double>(mix(key ^ mix(of)) >> 11) * 0x1p-53; }

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
  [[nodiscard]] double place(std::uint64_t part) const { return static_cast<double>(part) + chance(key_, part); }
  std::uint64_t count_, key_, part_ = 0;
  double reached_ = 0, next_;
};

constexpr std::uint32_t pilot_half = 2;

/// A quarter of its samples in each, so that to look at a pixel costs half of what it has cost.
std::uint32_t half_for(const PixelState& pixel) {
  return pixel.refined() ? std::max(pilot_half, std::bit_ceil(pixel.count()) / 4) : pilot_half;
}

}  // namespace

AuditSize thorough_audit(std::size_t pixels) { return {.looks = std::max(2048.0, static_cast<double>(pixels) / 32)}; }

AuditSize audit_within(std::span<const PixelState> pixels, double samples_most) {
  constexpr double looks_least = 64;
  constexpr std::uint32_t draws_least = 16;
  AuditSize size = thorough_audit(pixels.size());
  double expected = 0, samples = 0;
  for (const PixelState& pixel : pixels) {
    if (!pixel.refined()) continue;
    expected += pixel.variance;
    samples += double{pixel.variance} * 2 * half_for(pixel);
  }
  const double cost = 2 * pilot_half * size.looks + (expected > 0 ? size.draws * samples / expected : 0);
  const double part = std::min(1.0, samples_most / cost);
  size.looks = std::max(looks_least, size.looks * part);
  size.draws = std::max(draws_least, static_cast<std::uint32_t>(size.draws * part));
  return size;
}

std::vector<HoldoutPixel> choose_audits(std::span<const PixelState> pixels, const AuditSize& size, std::uint64_t stream,
                                        std::uint64_t seed) {
  double expected = 0;
  for (const PixelState& pixel : pixels) expected += pixel.refined() ? pixel.variance : 0;
  const double by_error = expected > 0 ? size.draws / expected : 0;
  const double spent = 2 * pilot_half * std::min(1.0, size.looks / static_cast<double>(pixels.size()));
  const std::uint64_t key = mix(mix(seed) ^ mix(~stream));
  Draws known(size.draws, key);
  std::vector<HoldoutPixel> choices;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::uint32_t half = half_for(pixels[i]);
    const double look = spent / (2 * half), error = pixels[i].refined() ? by_error * pixels[i].variance : 0;
    const std::uint32_t draws = known.draw(error) + (chance(~key, i) < look ? 1 : 0);
    if (draws > 0) choices.push_back({i, half, draws / (look + error)});
  }
  return choices;
}

std::vector<HoldoutPixel> choose_audits(std::size_t pixels, std::size_t count, std::uint64_t stream,
                                        std::uint64_t seed) {
  const std::uint64_t key = mix(mix(seed) ^ mix(~stream));
  const std::size_t draws = std::min(pixels, count);
  const double each = static_cast<double>(pixels) / static_cast<double>(draws);
  std::vector<HoldoutPixel> choices;
  for (std::size_t part = 0; part < draws; ++part) {
    const double at = (static_cast<double>(part) + chance(key, part)) * each;
    const std::size_t place = std::min(pixels - 1, static_cast<std::size_t>(at));
    if (!choices.empty() && choices.back().place == place) {
      choices.back().stands_for += each;
    } else {
      choices.push_back({place, pilot_half, each});
    }
  }
  return choices;
}

}  // namespace tracer
