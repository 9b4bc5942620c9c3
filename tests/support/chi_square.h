#pragma once
/// Chi-square tests of sampling routines.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "tests/support/random.h"
#include "tracer/src/math/vec.h"

namespace statistics {

/// No chi-square that is so rare is accepted: once in three million.
inline constexpr double deviate_max = 5;

/// The standard normal deviate that is exceeded as often as the chi-square of these counts (Wilson & Hilferty 1931).
/// Classes of small expectation are one.
inline double chi_square_deviate(const std::vector<double>& found, const std::vector<double>& expected) {
  double sum = 0, classes = 0, few_found = 0, few = 0;
  const auto add = [&](double of_found, double of_expected) {
    sum += (of_found - of_expected) * (of_found - of_expected) / of_expected;
    ++classes;
  };
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (expected[i] >= 10) {
      add(found[i], expected[i]);
    } else {
      few_found += found[i];
      few += expected[i];
    }
  }
  if (few + few_found > 0) add(few_found, std::max(few, 1.0));
  const double freedom = std::max(classes - 1, 1.0), variance = 2 / (9 * freedom);
  return (std::cbrt(sum / freedom) - (1 - variance)) / std::sqrt(variance);
}

/// Expects the directions of sample(xi), which are zero if there is none, with the frequency density(direction), in
/// bins of equal solid angle about `axis`, down to the cosine `lowest`, below which there are none.
template <class Sample, class Density>
void expect_distribution(const Sample& sample, const Density& density, const tracer::Vec3& axis, double lowest) {
  constexpr int rows = 12, columns = 24, fine = 48, count = 100'000;
  const double pi = std::numbers::pi, height = 1 - lowest, share = 2 * pi * height / (rows * columns * fine * fine);
  const tracer::Axes axes = tracer::axes_about(axis);
  std::vector<double> expected(rows * columns), found = expected;
  const auto bin = [](double row, double column) {
    return static_cast<std::size_t>(row * rows) * columns + static_cast<std::size_t>(column * columns) % columns;
  };
  for (int i = 0; i < rows * fine; ++i)
    for (int j = 0; j < columns * fine; ++j) {
      const double row = (i + std::fmod(0.618034 * j, 1)) / (rows * fine), column = (j + 0.5) / (columns * fine);
      const double z = 1 - height * row, across = std::sqrt(1 - z * z), angle = 2 * pi * column;
      expected[bin(row, column)] +=
          count * share *
          density(axes.e0 * (across * std::cos(angle)) + axes.e1 * (across * std::sin(angle)) + axes.n * z);
    }
  oracle::Random random(1);
  double all = 0;
  for (int i = 0; i < count; ++i) {
    const tracer::Vec3 d = sample(tracer::Vec2{random.in(0, 1), random.in(0, 1)});
    if (d == tracer::Vec3{}) continue;
    ASSERT_NEAR(tracer::length(d), 1, 1e-12);
    const double turn = std::atan2(dot(d, axes.e1), dot(d, axes.e0)) / (2 * pi), row = (1 - dot(d, axis)) / height;
    ASSERT_LT(row, 1);
    ++found[bin(std::max(row, 0.0), turn - std::floor(turn))];
    ++all;
  }
  EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0.0) / count, all / count, 2.5 / std::sqrt(count))
      << "the integral";
  EXPECT_LT(chi_square_deviate(found, expected), deviate_max);
}

/// The same of samples that have a `direction` and its `density`, which is 0 if there is none.
template <class Sample, class Density>
void expect_sampled_by_density(const Sample& sample, const Density& density, const tracer::Vec3& axis, double lowest) {
  const auto direction_of = [&](const tracer::Vec2& xi) {
    const auto one = sample(xi);
    if (one.density == 0) return tracer::Vec3{};
    EXPECT_NEAR(one.density, density(one.direction), 1e-9 * one.density);
    return one.direction;
  };
  expect_distribution(direction_of, density, axis, lowest);
}

}  // namespace statistics
