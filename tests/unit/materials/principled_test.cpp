// The principled material: everything is reflected by white surfaces, both ways alike, and samples have their density.
#include "tracer/src/materials/principled.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace tracer {
namespace {

constexpr double pi = std::numbers::pi;
constexpr Vec3 normal{0, 0, 1};

Vec3 direction(double cosine, double phi) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

Color gray(double value) { return {value, value, value}; }

/// Mean of sample().factor: the albedo of the facets.
double mean_factor(const PrincipledPoint& point, int side) {
  double sum = 0;
  for (int i = 0; i < side * side; ++i)
    sum +=
        point.sample({(i % side + 0.5) / side, (i / side + 0.5) / side}).factor.g;  // NOLINT(bugprone-integer-division)
  return sum / (side * side);
}

TEST(PrincipledMaterial, ReflectsAllLightIfItsBaseIsWhite) {
  for (const double roughness : {0.0, 0.03, 0.07, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0})
    for (const double cosine : {1.0, 0.9, 0.6, 0.3, 0.15, 0.07})
      for (const double metallic : {0.0, 0.5, 1.0})
        for (const double ior : {1.0, 1.1, 1.5, 2.4}) {
          const double reflectance = std::pow((ior - 1) / (ior + 1), 2);
          PrincipledSurface white{.base = gray(1),
                                  .metal = gray(1),
                                  .metallic = metallic,
                                  .f0 = gray(reflectance),
                                  .alpha = roughness * roughness};
          const PrincipledPoint point(white, normal, direction(cosine, 0.7));
          EXPECT_NEAR(point.matt_albedo().g + mean_factor(point, 64), 1, 0.005)
              << roughness << ' ' << cosine << ' ' << metallic << ' ' << ior;
          white.coat = 1;
          white.coat_alpha = 0.04;
          const PrincipledPoint coated(white, normal, direction(cosine, 0.7));
          const double all = coated.matt_albedo().g + mean_factor(coated, 64);
          EXPECT_LE(all, 1.005) << roughness << ' ' << cosine << ' ' << metallic << ' ' << ior;
          EXPECT_GE(all, metallic == 0 ? 0.98 : 0.9) << roughness << ' ' << cosine << ' ' << metallic << ' ' << ior;
        }
}

TEST(PrincipledMaterial, IsTheSameBothWays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const PrincipledSurface surface{.base = {uniform(random), uniform(random), uniform(random)},
                                    .metal = {uniform(random), uniform(random), uniform(random)},
                                    .metallic = uniform(random),
                                    .f0 = {uniform(random), uniform(random), uniform(random)},
                                    .f90 = uniform(random),
                                    .alpha = std::pow(0.05 + 0.95 * uniform(random), 2),
                                    .coat = std::max(2 * uniform(random) - 1, 0.0),
                                    .coat_alpha = std::pow(0.05 + 0.95 * uniform(random), 2)};
    const Vec3 v = direction(0.01 + 0.99 * uniform(random), 6 * uniform(random)),
               l = direction(0.01 + 0.99 * uniform(random), 6 * uniform(random));
    const Color there = PrincipledPoint(surface, normal, v).lit(l) * (1 / l.z);
    const Color back = PrincipledPoint(surface, normal, l).lit(v) * (1 / v.z);
    for (const auto c : {&Color::r, &Color::g, &Color::b}) ASSERT_NEAR(there.*c, back.*c, 1e-9 * (1 + there.*c));
  }
}

TEST(PrincipledMaterial, SamplesDirectionsByTheirDensity) {
  constexpr int rows = 12, columns = 24, samples = 200000;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const double roughness : {0.2, 0.5, 1.0})
    for (const double cosine : {0.97, 0.6, 0.15}) {
      const PrincipledSurface surface{
          .f0 = gray(1), .alpha = roughness * roughness, .coat = roughness == 0.5 ? 0.0 : 1.0, .coat_alpha = 0.09};
      const Vec3 tilted = normalize({0.3, -0.5, 0.8});
      const Axes axes = axes_about(tilted);
      const Vec3 local = direction(cosine, 2.5);
      const PrincipledPoint point(surface, tilted, axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
      // Bins of equal solid angle in the frame of the mirror direction are dense where the samples are.
      std::array<std::array<double, columns>, rows> expected{}, found{};
      const auto bin = [&](const Vec3& d) {
        const double z = dot(d, tilted), phi = std::atan2(dot(d, axes.e1), dot(d, axes.e0)) / (2 * pi) + 0.5;
        return std::pair{std::min(static_cast<int>(z * rows), rows - 1),
                         std::min(static_cast<int>(phi * columns), columns - 1)};
      };
      constexpr int fine = 24;
      for (int i = 0; i < rows * fine; ++i)
        for (int j = 0; j < columns * fine; ++j) {
          const Vec3 d = direction((i + 0.5) / (rows * fine), 2 * pi * ((j + 0.5) / (columns * fine) - 0.5));
          const double there = point.density(axes.e0 * d.x + axes.e1 * d.y + axes.n * d.z);
          expected[i / fine][j / fine] += samples * there * 2 * pi / (rows * fine * columns * fine);  // NOLINT
        }
      for (int i = 0; i < samples; ++i) {
        const PrincipledPoint::Sample sample = point.sample({uniform(random), uniform(random)});
        if (sample.density == 0) continue;
        ASSERT_NEAR(sample.density, point.density(sample.direction), 1e-9 * sample.density);
        const auto [row, column] = bin(sample.direction);
        ++found[row][column];
      }
      double chi_square = 0, freedom = 0;
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
          if (expected[i][j] < 20) continue;
          chi_square += std::pow(found[i][j] - expected[i][j], 2) / expected[i][j];
          ++freedom;
        }
      EXPECT_LT((chi_square - freedom) / std::sqrt(2 * freedom), 5) << roughness << ' ' << cosine << ' ' << freedom;
    }
}

TEST(PrincipledMaterial, HasBoundedHighlights) {
  for (const double cosine : {1.0, 0.1, 1e-3, 1e-6})
    for (int i = 0; i < 2000; ++i) {
      const PrincipledPoint point({.f0 = gray(1), .alpha = 0, .coat = 1}, normal, direction(cosine, 0));
      EXPECT_LE(point.lit(direction(std::pow(10.0, -6 * i / 2000.0), pi)).g,
                PrincipledSurface::highlight_max * (1 + 1e-9));
    }
}

}  // namespace
}  // namespace tracer
