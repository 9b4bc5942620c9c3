// Checker, gradient and noise: values at points, and means over footprints.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using Wrap = Texture::Wrap;

/// Mean of `f` over [x - w/2, x + w/2], piece by piece between whole numbers, where it is linear.
template <class Function>
Real mean_of(const Function& f, double x, double w) {
  const Real left = Real(x) - Real(w) / 2, right = Real(x) + Real(w) / 2;
  Real sum = 0;
  for (Real a = left; a < right;) {
    const Real b = std::fmin(right, std::floor(a) + 1);
    sum += (b - a) * f((a + b) / 2);
    a = b;
  }
  return sum / (right - left);
}

Real sign_at(Real t) { return std::fmod(std::floor(t), 2.0L) == 0 ? 1 : -1; }

Real wrapped_at(Wrap wrap, Real t) {
  if (wrap == Wrap::clamp) return std::fmin(std::fmax(t, 0.0L), 1.0L);
  const Real turn = t - 2 * std::floor(t / 2);
  if (wrap == Wrap::mirror) return turn < 1 ? turn : 2 - turn;
  return t - std::floor(t);
}

TEST(BoxFilter, OfACheckerIsItsIntegralAtEveryPlaceAndWidth) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const double x = random.chance(0.3) ? std::round(random.in(-9, 9)) + random.sign() * random.spread(1e-15, 1)
                                        : random.in(-100, 100);
    const double w = random.spread(1e-14, 300);
    ASSERT_NEAR(alternating_mean(x, w), static_cast<double>(mean_of(sign_at, x, w)),
                2e-15 * (1 + std::abs(x)) / w + 1e-14)
        << x << " " << w;
  }
  EXPECT_EQ(alternating_mean(1e15, 1e30), 0);
  EXPECT_LE(std::abs(alternating_mean(0.3, 1e6)), 1e-6);
}

TEST(BoxFilter, OfAGradientIsItsIntegralUnderEveryWrap) {
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const auto wrap = static_cast<Wrap>(random.below(3));
    const double x = random.in(-6, 6), w = random.spread(1e-12, 40);
    const auto f = [&](Real t) { return wrapped_at(wrap, t); };
    ASSERT_NEAR(wrapped_mean(wrap, x, w), static_cast<double>(mean_of(f, x, w)), 1e-14 / std::fmin(1.0, w) + 1e-14)
        << static_cast<int>(wrap) << " " << x << " " << w;
  }
}

TEST(Wrap, RepeatsClampsOrMirrorsFarFromTheOrigin) {
  EXPECT_EQ(wrapped(Wrap::repeat, -0.25), 0.75);
  EXPECT_EQ(wrapped(Wrap::clamp, -0.25), 0);
  EXPECT_EQ(wrapped(Wrap::mirror, -0.25), 0.25);
  EXPECT_EQ(wrapped(Wrap::repeat, 3.25), 0.25);
  EXPECT_EQ(wrapped(Wrap::clamp, 3.25), 1);
  EXPECT_EQ(wrapped(Wrap::mirror, 3.25), 0.75);
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror})
    for (double x = 1; x < 1e300; x *= 977)
      for (const double at : {x, -x}) {
        EXPECT_GE(wrapped(wrap, at), 0);
        EXPECT_LE(wrapped(wrap, at), 1);
      }
}

TEST(Gradient, GoesFromItsFirstColourAtTheBottomToItsSecondOnTop) {
  Texture sky{GradientTexture{{Color{1, 0, 0}, {0, 0, 2}}}, {1, 1}, {}, ""};
  EXPECT_EQ(texture_color(sky, {0.7, 0}), (Color{1, 0, 0}));
  EXPECT_EQ(texture_color(sky, {0.7, 0.25}), (Color{0.75, 0, 0.5}));
  EXPECT_EQ(texture_color(sky, {0.7, 1.25}), (Color{0.75, 0, 0.5})) << "repeats";
  sky.wrap = Wrap::clamp;
  EXPECT_EQ(texture_color(sky, {0.7, 7}), (Color{0, 0, 2}));
  sky.wrap = Wrap::mirror;
  EXPECT_EQ(texture_color(sky, {0.7, 1.25}), (Color{0.25, 0, 1.5}));
}

TEST(Noise, UsesMostOfTheRangeWithinOneWithTheSameContrastForEveryNumberOfOctaves) {
  const std::uint64_t count = effort::cases(200'000);
  double deviation_of_one = 0;
  for (const std::uint32_t octaves : {1u, 2u, 4u, 8u}) {
    Random random(3);
    double lowest = 0, highest = 0, sum = 0, squares = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const double n = octave_noise(random.in(-1e4, 1e4), random.in(-1e4, 1e4), octaves, {});
      lowest = std::min(lowest, n);
      highest = std::max(highest, n);
      sum += n / static_cast<double>(count);
      squares += n * n / static_cast<double>(count);
    }
    if (octaves == 1) deviation_of_one = std::sqrt(squares);
    EXPECT_TRUE(lowest >= -1 && lowest < -0.7) << octaves << " octaves: " << lowest;
    EXPECT_TRUE(highest <= 1 && highest > 0.7) << octaves << " octaves: " << highest;
    EXPECT_NEAR(sum, 0, 5 / std::sqrt(static_cast<double>(count))) << octaves;
    EXPECT_NEAR(std::sqrt(squares) / deviation_of_one, 1, 0.05) << octaves;
  }
}

TEST(Noise, IsZeroAtIntegerCoordinatesForEveryNumberOfOctaves) {
  for (int i = -20; i < 20; ++i)
    for (int j = -20; j < 20; ++j)
      for (const std::uint32_t octaves : {1u, 3u, 32u}) EXPECT_EQ(octave_noise(i, j, octaves, {}), 0) << i << " " << j;
  EXPECT_EQ(gradient_noise(1e300, -1e300), 0);
}

TEST(Noise, IsContinuousAcrossItsCells) {
  Random random(4);
  for (std::uint64_t i = 0; i < effort::cases(50'000); ++i) {
    const double x = std::round(random.in(-50, 50)), y = random.in(-50, 50), step = 1e-9;
    ASSERT_NEAR(gradient_noise(x - step, y), gradient_noise(x + step, y), 10 * step) << x << " " << y;
    ASSERT_NEAR(gradient_noise(y, x - step), gradient_noise(y, x + step), 10 * step) << x << " " << y;
  }
}

TEST(Noise, OfOctavesIsTheirSumOverTheRootOfTheirSquaredAmplitudes) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const double x = random.in(-9, 9), y = random.in(-9, 9);
    const Real sum =
        gradient_noise(x, y) + Real(gradient_noise(2 * x, 2 * y)) / 2 + Real(gradient_noise(4 * x, 4 * y)) / 4;
    const Real scaled = std::clamp(sum / std::sqrt(1 + 1 / 4.0L + 1 / 16.0L), -1.0L, 1.0L);
    ASSERT_NEAR(octave_noise(x, y, 3, {}), static_cast<double>(scaled), 1e-15);
  }
}

TEST(Noise, HasTheMeanOverTheFootprintByBothOfItsSides) {
  Random random(6);
  for (std::uint64_t i = 0; i < effort::cases(200); ++i) {
    const double x = random.in(-9, 9), y = random.in(-9, 9);
    const Vec2 width{std::exp2(random.in(-12, 2)), std::exp2(random.in(-12, 2))};
    constexpr int side = 64;
    Real sum = 0;  // midpoint rule
    for (int row = 0; row < side; ++row)
      for (int column = 0; column < side; ++column)
        sum += gradient_noise(x + width.x * ((column + 0.5) / side - 0.5), y + width.y * ((row + 0.5) / side - 0.5));
    ASSERT_NEAR(gradient_noise_mean(x, y, width), static_cast<double>(sum / (side * side)), 4e-3) << x << " " << y;
  }
}

TEST(Noise, IsItsValueInANarrowFootprintAndOmitsOctavesFarFinerThanIt) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const double x = random.in(-9, 9), y = random.in(-9, 9);
    for (const Vec2& width : {Vec2{0x1p-17, 0}, Vec2{0, 0x1p-17}, Vec2{0x1p-17, 0x1p-20}})
      ASSERT_NEAR(gradient_noise_mean(x, y, width), gradient_noise(x, y), 1e-9);
    ASSERT_EQ(octave_noise(x, y, 4, {10, 10}), 0);
    ASSERT_EQ(octave_noise(x, y, 4, {1e300, 0}), 0);
    ASSERT_NEAR(octave_noise(x, y, 32, {0x1p-20, 0x1p-20}), octave_noise(x, y, 19, {}), 0x1p-17);
  }
}

TEST(Noise, IsTheSameOnEveryMachine) {  // a hash of coordinates: any change shows
  Random random(7);
  double checksum = 0;
  for (int i = 0; i < 1000; ++i) {
    const double x = random.in(-9, 9), y = random.in(-9, 9);
    checksum += gradient_noise(x, y) * (i + 1);
  }
  EXPECT_NEAR(checksum, -1213.1834046801484, 1e-9);
}

const Color even{1, 0, 0}, odd{0, 0, 1};
const Texture checker{CheckerTexture{{even, odd}}, {1, 1}, {0, 0}, ""};

TEST(Checker, HasItsFirstColourWhereTheFloorsSumIsEvenOnBothSidesOfNought) {
  for (int i = -5; i < 5; ++i)
    for (int j = -5; j < 5; ++j) {
      const Color expected = (i + j) % 2 == 0 ? even : odd;
      EXPECT_EQ(texture_color(checker, {i + 0.5, j + 0.5}), expected) << i << " " << j;
      EXPECT_EQ(texture_color(checker, {i + 0.0, j + 0.0}), expected) << "a square has its lower edges";
      EXPECT_EQ(texture_color(checker, {std::nextafter(i + 1.0, -10), j + 0.5}), expected) << "but not its upper ones";
    }
}

TEST(Checker, AppliesTheScaleBeforeTheOffset) {
  Texture scaled = checker;
  scaled.scale = {2, -3};
  scaled.offset = {0.5, 10};
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(10'000); ++i) {
    const Vec2 uv{random.in(-9, 9), random.in(-9, 9)};
    const Real sum = std::floor(uv.x * 2.0L + 0.5L) + std::floor(uv.y * -3.0L + 10);
    ASSERT_EQ(texture_color(scaled, uv), std::fmod(sum, 2.0L) == 0 ? even : odd);
  }
}

TEST(Checker, StaysOneOfItsColoursAtHugeCoordinates) {
  for (double u = 1; u < 1e300; u *= 31)
    for (const double v : {0.5, -u, u, 1e300}) {
      const Color color = texture_color(checker, {u, v});
      EXPECT_TRUE(color == even || color == odd) << u << " " << v;
    }
  // Up to 2^52 halves are exact, and so is the pattern.
  const double far = 0x1p52;
  EXPECT_EQ(texture_color(checker, {far, 0.5}), even);
  EXPECT_EQ(texture_color(checker, {far + 1, 0.5}), odd);
  EXPECT_EQ(texture_color(checker, {-far - 1, 0.5}), odd);
}

}  // namespace
}  // namespace tracer
