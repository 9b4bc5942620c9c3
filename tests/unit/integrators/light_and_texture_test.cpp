// Attenuation of lights, and the checker pattern.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;

TEST(Attenuation, IsItsFormulaAtEveryDistance) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(50'000); ++i) {
    const double d = random.spread(1e-60, 1e60);
    const std::array<double, 3> c{random.chance(0.2) ? 0 : random.spread(1e-9, 1e9),
                                  random.chance(0.2) ? 0 : random.spread(1e-9, 1e9), random.spread(1e-9, 1e9)};
    const Real capped = std::fmin(1 / (c[0] + c[1] * Real(d) + c[2] * Real(d) * d), 1.0L);
    ASSERT_NEAR(polynomial_attenuation(c, d), static_cast<double>(capped), 1e-15 * static_cast<double>(capped));
    const auto squared = static_cast<double>(1 / (Real(d) * d));
    ASSERT_NEAR(inverse_square_attenuation(d), squared, 1e-15 * squared);
  }
}

TEST(Attenuation, OfThePolynomialIsCappedAtOneAlsoAtTheLightItself) {
  EXPECT_EQ(polynomial_attenuation({0, 0, 1}, 0), 1);
  EXPECT_EQ(polynomial_attenuation({0, 0, 1}, 0.5), 1);
  EXPECT_EQ(polynomial_attenuation({0, 0, 1}, 2), 0.25);
  EXPECT_EQ(polynomial_attenuation({2, 1, 0}, 2), 0.25);
  EXPECT_EQ(inverse_square_attenuation(0.5), 4) << "unclamped";
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
