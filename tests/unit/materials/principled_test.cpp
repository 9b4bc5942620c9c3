// The principled material: everything is reflected by white surfaces, both ways alike, and samples have their density.
#include "tracer/src/materials/principled.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/chi_square.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr double pi = std::numbers::pi;
constexpr Vec3 normal{0, 0, 1};

Vec3 direction(double cosine, double phi) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

Color gray(double value) { return {value, value, value}; }

/// Share of the light that is reflected: of the matt part, and the mean of sample().factor.
double albedo(const PrincipledPoint& point) {
  constexpr std::uint32_t count = 4096;
  double sum = 0;
  for (std::uint32_t i = 0; i < count; ++i)
    sum += point.sample({(i + 0.5) / count, reverse_bits(i) * 0x1p-32}).factor.g;
  return point.matt_albedo().g + sum / count;
}

TEST(PrincipledMaterial, ReflectsAllLightIfItsBaseIsWhite) {
  for (const double roughness : {0.0, 0.03, 0.07, 0.1, 0.13, 0.2, 0.25, 0.3, 0.32, 0.35, 0.4, 0.55, 0.7, 0.85, 1.0})
    for (const double cosine : {1.0, 0.9, 0.6, 0.3, 0.15, 0.07, 0.05})
      for (const double metallic : {0.0, 0.5, 1.0})
        for (const double ior : {1.0, 1.1, 1.5, 2.4}) {
          SCOPED_TRACE(testing::Message() << roughness << ' ' << cosine << ' ' << metallic << ' ' << ior);
          const double reflectance = std::pow((ior - 1) / (ior + 1), 2);
          PrincipledSurface white{.base = gray(1),
                                  .metal = gray(1),
                                  .metallic = metallic,
                                  .f0 = gray(reflectance),
                                  .alpha = roughness * roughness};
          EXPECT_NEAR(albedo({white, normal, direction(cosine, 0.7)}), 1, 0.005);
          white.coat = 1;
          white.coat_alpha = 0.04;
          const double coated = albedo({white, normal, direction(cosine, 0.7)});
          EXPECT_LE(coated, 1.005);
          EXPECT_GE(coated, 0.98 - 0.025 * metallic) << "the facets below have the smaller of both ways";
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
  const Vec3 tilted = normalize({0.3, -0.5, 0.8});
  const Axes axes = axes_about(tilted);
  for (const double roughness : {0.2, 0.5, 1.0})
    for (const double cosine : {0.97, 0.6, 0.15}) {
      SCOPED_TRACE(testing::Message() << roughness << ' ' << cosine);
      const PrincipledSurface surface{
          .f0 = gray(1), .alpha = roughness * roughness, .coat = roughness == 0.5 ? 0.0 : 1.0, .coat_alpha = 0.09};
      const Vec3 local = direction(cosine, 2.5);
      const PrincipledPoint point(surface, tilted, axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
      statistics::expect_sampled_by_density([&](const Vec2& xi) { return point.sample(xi); },
                                            [&](const Vec3& d) { return point.density(d); }, tilted, 0);
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
