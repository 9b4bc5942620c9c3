// Classes of pixels, by their pilots.
#include "tracer/src/sampling/pixel_classes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/random.h"

namespace tracer {
namespace {

constexpr std::uint32_t columns = 32;

/// Pilots of an image whose pixels are functions of their column and row.
struct PilotGrid {
  PilotGrid(const std::function<float(int x, int y)>& level,
            const std::function<SampleSignature(int x, int y)>& signature, bool noisy = false) {
    for (int y = 0; y < static_cast<int>(columns); ++y)
      for (int x = 0; x < static_cast<int>(columns); ++x) {
        code_values.push_back(level(x, y));
        signatures.push_back(signature(x, y));
      }
    sort(noisy);
  }
  void sort(bool noisy) {
    counts = classify({columns, columns, {code_values, code_values, code_values}, signatures, features, noisy},
                      {0, 0, columns, columns}, classes);
  }
  [[nodiscard]] PixelKind kind(std::size_t x, std::size_t y) const { return pixel_kind(classes[y * columns + x]); }

  std::vector<float> code_values;  // of each channel
  std::vector<SampleSignature> signatures;
  std::vector<float> features{};
  std::vector<PixelClass> classes = std::vector<PixelClass>(columns * columns);
  ByClass<ClassCount> counts{};
};

SampleSignature surface(std::uint32_t number) { return {.surface = 2 * number + 1, .normal = {0, 0, 127}}; }
float flat(int, int) { return 100; }

TEST(PixelClasses, AreMixedWhereverALineCrossesThePixel) {
  oracle::Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const double angle = random.in(0, 6.3), c = std::cos(angle), s = std::sin(angle), at = random.in(4, 28) * (c + s);
    const auto beyond = [&](double x, double y) { return x * c + y * s > at; };
    const PilotGrid pilots(flat, [&](int x, int y) { return surface(beyond(x + 0.5, y + 0.5) ? 1 : 2); });
    for (std::uint32_t y = 1; y + 1 < columns; ++y)
      for (std::uint32_t x = 1; x + 1 < columns; ++x) {
        const double u = x, v = y;
        const int corners = beyond(u, v) + beyond(u + 1, v) + beyond(u, v + 1) + beyond(u + 1, v + 1);
        EXPECT_TRUE(corners % 4 == 0 || is_mixed(pilots.classes[y * columns + x])) << x << " " << y;
      }
  }
}

TEST(PixelClasses, CountTheSidesWithAnotherSignature) {
  const PilotGrid pilots(flat, [](int x, int y) { return surface(x == 8 && y == 8 ? 1 : x >= 20 ? 2 : 3); });
  EXPECT_EQ(pilots.kind(8, 8), PixelKind::more_sides);
  EXPECT_EQ(pilots.kind(9, 8), PixelKind::one_side);
  EXPECT_EQ(pilots.kind(9, 9), PixelKind::corner);
  EXPECT_EQ(pilots.kind(10, 8), PixelKind::smooth);
  EXPECT_EQ(pilots.kind(19, 3), PixelKind::one_side);
}

TEST(PixelClasses, DependOnLightsThatReachOneSampleAndAreOccludedAtTheOther) {
  const auto lights = [](std::uint8_t lit, std::uint8_t occluded) {
    return [=](int x, int) {
      SampleSignature signature = surface(1);
      (x < 16 ? signature.lit : signature.occluded) = x < 16 ? lit : occluded;
      return signature;
    };
  };
  EXPECT_EQ(PilotGrid(flat, lights(1, 1)).kind(15, 9), PixelKind::one_side);
  EXPECT_EQ(PilotGrid(flat, lights(1, 2)).kind(15, 9), PixelKind::smooth)
      << "another light, and the surface turns away";
}

TEST(PixelClasses, HaveTheErrorOfTheCenterOfAParabola) {
  const auto parabola = [](int x, int y) { return static_cast<float>(0.5 * x * x + 0.25 * y * y); };
  const PilotGrid pilots(parabola, [](int, int) { return surface(1); });
  // The mean of a x^2 + b y^2 over a pixel is (a + b) / 12 above the center.
  const double expected = 3 * std::pow((0.5 + 0.25) / 12, 2);
  const PixelClass inside = pilots.classes[8 * columns + 8];
  EXPECT_EQ(pixel_kind(inside), PixelKind::smooth);
  EXPECT_NEAR(pilots.counts[inside].curvature / pilots.counts[inside].pixels, expected, 0.05 * expected)
      << "with those at the border";
}

TEST(PixelClasses, OfNoiseHaveItsVarianceAndTheirOwnErrors) {
  oracle::Random random(6);
  constexpr double deviation = 12;
  PilotGrid pilots([&](int, int) { return static_cast<float>(100 + std::sqrt(3) * deviation * random.in(-1, 1)); },
                   [](int, int) { return surface(1); }, true);
  double sum = 0;
  for (std::size_t c = 0; c < class_count; ++c) sum += pilots.counts[c].curvature;
  const double expected = 2 * 3 * deviation * deviation;
  EXPECT_NEAR(sum / (columns * columns), expected, 0.15 * expected);
  pilots.features.assign(columns * columns, 3 * 20);  // much less than the noise
  pilots.features[5 * columns + 7] = 3 * 3000;
  pilots.sort(true);
  EXPECT_EQ(pilots.kind(7, 5), PixelKind::feature);
  EXPECT_EQ(pilots.kind(7, 6), PixelKind::smooth);
}

TEST(PixelClasses, OfFeaturesDoNotDependOnThePilots) {
  PilotGrid pilots(flat, [](int, int) { return surface(1); });
  pilots.features.assign(columns * columns, -1);
  pilots.features[5 * columns + 7] = 3 * 300;
  pilots.sort(false);
  const PixelClass feature = pilots.classes[5 * columns + 7];
  EXPECT_EQ(pixel_kind(feature), PixelKind::feature);
  EXPECT_EQ(pilots.counts[feature].pixels, 1);
  EXPECT_EQ(pilots.counts[feature].missed, 3 * 300);
}

TEST(PixelClasses, OfMirrorsAreApartFromThoseOfOtherSmoothSurfaces) {
  const PilotGrid pilots(flat, [](int x, int) {
    SampleSignature signature = surface(1);
    if (x < 16) signature.add_secondary(7);
    return signature;
  });
  EXPECT_EQ(pilots.kind(4, 4), PixelKind::reflecting);
  EXPECT_EQ(pilots.kind(24, 4), PixelKind::smooth);
  for (const std::size_t x : {15, 16}) EXPECT_EQ(static_cast<int>(pilots.kind(x, 4)), 4 + 1) << "an edge of the mirror";
}

}  // namespace
}  // namespace tracer
