// Points on soft lights are uniform over their length, area or surface: chi-square of what each has a distribution for.
// Attenuation of lights.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "tests/support/chi_square.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/lights/light_registry.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// Expects `share` of the light's points to be uniform over [0, 1].
void expect_uniform(const CompiledLight& light, const std::function<Real(const Vec&)>& share) {
  constexpr int points = 100'000, bins = 32;
  Random random(1);
  std::vector<double> counted(bins);
  for (int i = 0; i < points; ++i) {
    const Real at = share(Vec(light_point(light, {random.in(0, 1), random.in(0, 1)})) - Vec(light.position));
    EXPECT_TRUE(at >= -1e-12L && at <= 1 + 1e-12L) << "beyond the light";
    ++counted[static_cast<std::size_t>(std::clamp<Real>(at * bins, 0, bins - 1))];
  }
  EXPECT_LT(statistics::chi_square_deviate(counted, std::vector(bins, points / double{bins})), statistics::deviate_max);
}

CompiledLight light_of(std::uint8_t kind) {
  CompiledLight light;
  light.kind = kind;
  light.position = {0.3, -0.2, 0.1};
  return light;
}

TEST(LightPoint, OfALineIsUniformAlongIt) {
  CompiledLight line = light_of(light_kind<LineLight>);
  line.u = {1, 2, -0.5};
  const Vec u = line.u;
  expect_uniform(line, [&](const Vec& p) { return dot(p, u) / dot(u, u); });
}

TEST(LightPoint, OfAParallelogramIsUniformAlongBothEdgesAndItsDiagonal) {
  CompiledLight rect = light_of(light_kind<RectLight>);
  rect.u = {1, 0.2, 0};
  rect.v = {0.3, 0.1, 2};
  const Vec u = rect.u, v = rect.v, n = cross(u, v);
  const auto along_u = [&](const Vec& p) { return dot(cross(p, v), n) / dot(n, n); };
  const auto along_v = [&](const Vec& p) { return dot(cross(u, p), n) / dot(n, n); };
  expect_uniform(rect, along_u);
  expect_uniform(rect, along_v);
  // Of two that are uniform and independent the sum, without its whole part, is uniform too.
  const auto both = [&](const Vec& p) {
    const Real sum = along_u(p) + along_v(p);
    return sum - std::floor(sum);
  };
  expect_uniform(rect, both);
}

TEST(LightPoint, OfADiscIsUniformInAreaAcrossItInAnyDirection) {
  CompiledLight disc = light_of(light_kind<DiscLight>);
  disc.u = {0.7, 0, 0};
  disc.v = {0, 0, 0.7};
  for (const Real turn : {0.0L, 0.7L, 2.0L}) {
    // The part of a disc on one side of a line at x radii from its middle.
    const auto segment = [turn](const Vec& p) {
      const Real x = (p.x * std::cos(turn) + p.z * std::sin(turn)) / 0.7L;
      const Real c = std::clamp<Real>(x, -1, 1);
      return 0.5L + (c * std::sqrt(1 - c * c) + std::asin(c)) / std::numbers::pi_v<Real>;
    };
    expect_uniform(disc, segment);
  }
}

TEST(LightPoint, OfASphereIsUniformInHeightAlongAnyAxisAsArchimedesFound) {
  CompiledLight sphere = light_of(light_kind<SphereLight>);
  sphere.radius = 1.7;
  for (const Vec& axis : {Vec(0, 0, 1), Vec(1, 0, 0), unit(Vec(1, -2, 0.5L))})
    expect_uniform(sphere, [&](const Vec& p) { return 0.5L + dot(p, axis) / (2 * 1.7L); });
}

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

}  // namespace
}  // namespace tracer
