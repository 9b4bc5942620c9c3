#include "tracer/src/sampling/proof.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace {

using namespace tracer;

Color gray(double value) { return {value, value, value}; }

DisplayTransform curve(Output::Overflow overflow) {
  Output output;
  output.overflow = overflow;
  return {output, 0};
}

/// Halves of n samples, of which each is `bright` with probability p and else `dark`.
Halves halves(oracle::Random& random, std::uint32_t n, double p, double dark, double bright) {
  Halves both{};
  for (Color& half : both) {
    std::uint32_t hits = 0;
    for (std::uint32_t i = 0; i < n; ++i) hits += random.chance(p) ? 1 : 0;
    half = gray(dark + (bright - dark) * hits / n);
  }
  return both;
}

TEST(SquaredError, OfEqualHalvesIsTheirSquaredDistance) {
  const DisplayTransform display = curve(Output::Overflow::clamp);
  const double distance = display.level(0.5) - display.level(0.25);
  EXPECT_NEAR(squared_error(gray(0.25), {gray(0.5), gray(0.5)}, display), 3 * distance * distance, 1e-9 * distance);
}

/// The mean over many looks, against the squared error of the true mean.
TEST(SquaredError, IsNearlyUnbiasedOrTooLarge) {
  oracle::Random random(1);
  const DisplayTransform display = curve(Output::Overflow::clamp);
  struct Case {
    double p, dark, bright, pixel;
  };
  constexpr int looks = 60'000;
  for (const auto& [p, dark, bright, pixel] :
       {Case{0.5, 0.2, 0.6, 0.4}, Case{0.5, 0.2, 0.6, 0.3}, Case{0.02, 0.3, 1, 0.3}, Case{0.02, 0, 1, 0},
        Case{0.002, 0, 1, 0}, Case{0.3, 0.05, 0.9, 0.05}, Case{0.02, 0.8, 0, 0.8}, Case{0.1, 0, 1, 0.05},
        Case{0.5, 0, 1, 0.5}, Case{0.5, 0, 1, 0.3}}) {
    double sum = 0, squares = 0;
    for (int i = 0; i < looks; ++i) {
      const double found = squared_error(gray(pixel), halves(random, 8, p, dark, bright), display);
      sum += found;
      squares += found * found;
    }
    const double truth = display.level(dark + (bright - dark) * p) - display.level(pixel), mean = sum / looks;
    const double deviation = std::sqrt((squares / looks - mean * mean) / looks);
    EXPECT_GE(mean + 4 * deviation, 0.93 * 3 * truth * truth) << p << " " << dark << " " << bright << " " << pixel;
  }
}

TEST(SquaredError, IsWithinItsBound) {
  oracle::Random random(2);
  for (const auto overflow : {Output::Overflow::clamp, Output::Overflow::reinhard}) {
    const DisplayTransform display = curve(overflow);
    for (int i = 0; i < 100'000; ++i) {
      const double a = random.spread(1e-4, 1), b = random.chance(0.3) ? random.spread(1e-3, 30) : random.in(0, 1);
      const double low = random.chance(0.3) ? 0 : std::min(a, b), high = std::max(a, b);
      const auto inside = [&] { return random.chance(0.2) ? (random.chance(0.5) ? low : high) : random.in(low, high); };
      RadianceInterval interval;
      interval.low.fill(static_cast<float>(low) * (1 - 0x1p-20F));
      interval.high.fill(static_cast<float>(high) * (1 + 0x1p-20F));
      const Color pixel = gray(random.chance(0.1) ? random.in(0, 1) : inside());
      const Halves fresh{gray(inside()), gray(inside())};
      EXPECT_LE(squared_error(pixel, fresh, display), squared_error_bound(interval, pixel, display) * (1 + 1e-6))
          << low << " " << high << " " << pixel.r << " " << fresh[0].r << " " << fresh[1].r;
    }
  }
}

}  // namespace
