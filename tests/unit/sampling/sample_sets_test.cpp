// Sets of samples: stratified over the pixel, independent of each other, and numbered within their tile.
#include "tracer/src/sampling/sample_sets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/scenes.h"

namespace tracer {
namespace {

using Kind = SampleSets::Kind;

class SampleSetsOfPixels : public ::testing::Test {
 protected:
  [[nodiscard]] Batch sets(const SampleSets& of_pixel, Pixel pixel) const {
    Batch batch;
    push_sets(batch, *scene, pixel, of_pixel);
    return batch;
  }
  std::shared_ptr<const CompiledScene> scene = [] {
    RenderControl control;
    return *compile(scenes::empty(64), control);
  }();
};

/// Each cell of a row of cells has one sample, and the height of the row is proportional to the number of its cells.
TEST_F(SampleSetsOfPixels, HaveOneSampleInEachOfAsManyCellsOfEqualArea) {
  for (const std::uint32_t count : {2u, 3u, 6u, 10u, 14u, 22u, 64u}) {
    const Batch batch = sets({.kind = Kind::joint, .samples = count}, {5, 7});
    ASSERT_EQ(batch.x.size(), count);
    const auto rows = static_cast<std::uint32_t>(std::lround(std::sqrt(count)));
    std::uint32_t index = 0;
    double top = 0;
    for (std::uint32_t row = 0; row < rows; ++row) {
      const std::uint32_t cells = (row + 1) * count / rows - row * count / rows;
      const double height = static_cast<double>(cells) / count;
      for (std::uint32_t cell = 0; cell < cells; ++cell, ++index) {
        EXPECT_GE(batch.x[index] - 5, static_cast<double>(cell) / cells - 1e-12);
        EXPECT_LE(batch.x[index] - 5, (cell + 1.0) / cells + 1e-12);
        EXPECT_GE(batch.y[index] - 7, top - 1e-12);
        EXPECT_LE(batch.y[index] - 7, top + height + 1e-12);
      }
      top += height;
    }
    EXPECT_NEAR(top, 1, 1e-12);
  }
}

/// Correlation of the heights of the first samples of two sets over many pixels, relative to that of independent ones.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += 12 * (a[i] - 0.5) * (b[i] - 0.5);
  return sum / std::sqrt(static_cast<double>(a.size()));
}

TEST_F(SampleSetsOfPixels, AreIndependentOfEachOther) {
  std::vector<double> joint, first, second, next, neighbor;
  for (std::uint32_t y = 0; y < 64; ++y)
    for (std::uint32_t x = 0; x < 64; ++x) {
      const Batch one = sets({.kind = Kind::joint, .samples = 2}, {x, y});
      const Batch halves = sets({.kind = Kind::measured, .samples = 4}, {x, y});
      const Batch later = sets({.kind = Kind::joint, .samples = 2, .round = 1}, {x, y});
      joint.push_back(one.y[0] - y);
      first.push_back(halves.y[0] - y);
      second.push_back(halves.y[2] - y);
      next.push_back(later.y[0] - y);
      neighbor.push_back(sets({.kind = Kind::joint, .samples = 2}, {(x + 1) % 64, y}).y[0] - y);
    }
  for (const auto* other : {&first, &second, &next, &neighbor}) EXPECT_LT(std::abs(correlation(joint, *other)), 4.5);
  EXPECT_LT(std::abs(correlation(first, second)), 4.5);
  EXPECT_GT(correlation(joint, joint), 50);
}

TEST(Tiles, NumberTheirPixels) {
  const Tiles tiles({3, 5, 80, 60});
  std::size_t pixels = 0;
  for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
    const std::vector<Pixel> list = tiles.pixels(tile);
    for (const Pixel& pixel : list) {
      EXPECT_EQ(tiles.index(pixel), tile);
      const Pixel same = tiles.pixel(tiles.place(pixel));
      EXPECT_EQ(same.x, pixel.x);
      EXPECT_EQ(same.y, pixel.y);
    }
    pixels += list.size();
  }
  EXPECT_EQ(pixels, 77u * 55u);
}

TEST(Tiles, AreVisitedOnceInScatteredOrder) {
  for (const std::uint64_t count : {1u, 2u, 7u, 64u, 240u, 1000u}) {
    std::vector<int> visits(count);
    for (std::uint64_t i = 0; i < count; ++i) ++visits[scattered(i, count)];
    for (const int one : visits) EXPECT_EQ(one, 1);
  }
}

}  // namespace
}  // namespace tracer
