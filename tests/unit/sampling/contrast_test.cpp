// Contrast of an image, and the error estimate of images with equally many samples per pixel.

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {
namespace {

/// Contrasts of all pixels; `codes`: three code values per pixel.
std::vector<float> contrasts(const std::vector<float>& codes, std::size_t columns, bool descending = false) {
  const std::size_t rows = codes.size() / 3 / columns;
  ContrastRows contrast(columns, rows, [&](std::size_t y, CodeValueRow& row) {
    for (std::size_t x = 0; x < columns; ++x)
      for (std::size_t channel = 0; channel < 3; ++channel) row[channel][x] = codes[3 * (y * columns + x) + channel];
  });
  std::vector<float> all(codes.size() / 3);
  for (std::size_t i = 0; i < rows; ++i) {
    const std::size_t y = descending ? rows - 1 - i : i;
    const auto row = contrast.row(y);
    std::copy(row.begin(), row.end(), all.begin() + static_cast<std::ptrdiff_t>(y * columns));
  }
  return all;
}

/// The definition, pixel by pixel.
double contrast_at(const std::vector<float>& codes, std::int64_t columns, std::int64_t rows, std::int64_t x,
                   std::int64_t y) {
  double most = 0;
  for (const auto& direction : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
    const int dx = direction.first, dy = direction.second;
    if ((dx != 0 && columns < 3) || (dy != 0 && rows < 3)) continue;
    const std::int64_t cx = dx != 0 ? std::clamp<std::int64_t>(x, 1, columns - 2) : x;
    const std::int64_t cy = dy != 0 ? std::clamp<std::int64_t>(y, 1, rows - 2) : y;
    double sum = 0;
    for (int channel = 0; channel < 3; ++channel) {
      const auto level = [&](std::int64_t step) {
        return double{codes[static_cast<std::size_t>(3 * ((cy + step * dy) * columns + cx + step * dx) + channel)]};
      };
      sum += std::pow(level(-1) - 2 * level(0) + level(1), 2);
    }
    most = std::max(most, sum);
  }
  return most;
}

TEST(Contrast, IsTheLargestSecondDifferenceInImagesOfAnyShapeAndOrderOfRows) {
  oracle::Random random(11);
  for (const auto& [columns, rows] :
       {std::pair{1, 1}, {1, 5}, {5, 1}, {2, 2}, {2, 7}, {7, 2}, {3, 3}, {3, 8}, {19, 3}, {37, 11}}) {
    std::vector<float> codes(static_cast<std::size_t>(3 * columns * rows));
    for (float& level : codes) level = static_cast<float>(random.in(0, 255));
    const std::vector<float> found = contrasts(codes, static_cast<std::size_t>(columns));
    EXPECT_EQ(found, contrasts(codes, static_cast<std::size_t>(columns), true));
    for (int i = 0; i < columns * rows; ++i) {
      const double predicted = contrast_at(codes, columns, rows, i % columns, i / columns);
      // Floats up to 255: the error of their second difference is at most 2^-14.
      EXPECT_NEAR(found[static_cast<std::size_t>(i)], predicted, 3 * 0x1p-12 * std::sqrt(predicted) + 0x1p-24)
          << columns << 'x' << rows << " at " << i;
    }
  }
}

TEST(PredictedVariance, IsThatOfAnEdgeAtARandomPosition) {
  // The center has the value of one side, the mean a fraction u of the other: the mean of min(u, 1 - u)^2 is 1/12.
  double sum = 0;
  constexpr int steps = 100'000;
  for (int i = 0; i < steps; ++i) {
    const double u = (i + 0.5) / steps;
    sum += std::pow(std::min(u, 1 - u), 2) / steps;
  }
  EXPECT_NEAR(predicted_variance(3 * 100 * 100), 3 * 100 * 100 * sum, 1e-3);
  EXPECT_LT(predicted_variance(3 * 4), 3 * 4 * sum);
}

std::vector<float> uniform_variance(const UniformPixels& pixels, const DisplayTransform& display) {
  UniformVariance variance(pixels, display);
  std::vector<float> all;
  for (std::size_t y = 0; y < pixels.rows(); ++y) {
    const auto row = variance.row(y);
    all.insert(all.end(), row.begin(), row.end());
  }
  return all;
}

TEST(UniformVariance, OfOneSampleIsPredictedFromTheContrast) {
  std::vector<float> rgb(3 * 24, 0.1f);
  for (std::size_t i = 12 * 3; i < rgb.size(); ++i) rgb[i] = 0.6f;
  const DisplayTransform display({}, 1);
  const auto variance = uniform_variance({rgb, {}, 4}, display);
  const double height = display.level(0.6f) - display.level(0.1f);
  EXPECT_NEAR(variance[9] / (3 * height * height / 12), 1, 1e-5);
  EXPECT_EQ(variance[0], 0);
}

TEST(UniformVariance, OfMoreSamplesIsTheirDeviationSquared) {
  const std::vector<float> rgb(3 * 9, 0.25f), deviation(3 * 9, 0.001f);
  const DisplayTransform display({}, 1);
  const double difference = display.level(0.25) - display.level(0.249);
  const auto variance = uniform_variance({rgb, deviation, 3}, display);
  for (const float one : variance) EXPECT_NEAR(one / (3 * difference * difference), 1, 1e-2);
}

/// An image in which each sample is 20 with a probability of 1 %, else 0: claimed and true root mean square errors.
struct RareLight {
  double claimed = 0, exact = 0;
};
RareLight rare_light(std::uint32_t samples, bool noisy) {
  constexpr std::uint32_t side = 96;
  constexpr double height = 20, share = 0.01;
  const Output output;
  const DisplayTransform display(output, 1);
  oracle::Random random(samples);
  Image image{side, side, {}};
  std::vector<float> deviation;
  double squared = 0;
  for (std::uint32_t i = 0; i < side * side; ++i) {
    PixelAccumulator all, half;
    for (std::uint32_t sample = 0; sample < samples; ++sample) {
      const double value = random.in(0, 1) < share ? height : 0;
      all.add({value, value, value});
      if (sample < samples / 2) half.add({value, value, value});
    }
    float mean[3], of_mean[3] = {};
    all.write(mean);
    all.write_deviation(half, of_mean);
    image.rgb.insert(image.rgb.end(), mean, mean + 3);
    if (samples > 1) deviation.insert(deviation.end(), of_mean, of_mean + 3);
    squared += std::pow(display.level(mean[0]) - display.level(height * share), 2) / (side * side);
  }
  UniformPixels pixels{image.rgb, deviation, side, samples};
  pixels.noisy = noisy;
  const ErrorContext context{display, {height, true}, output};
  const InParallel in_order = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for (std::uint64_t i = 0; i < count; ++i) work(i);
  };
  return {measure_uniform_errors(image, pixels, {}, context, in_order).estimate, std::sqrt(squared)};
}

TEST(UniformErrors, OfRareBrightLightCountThePixelsWithoutASampleOfIt) {
  for (const std::uint32_t samples : {1u, 2u, 4u, 8u, 16u, 64u}) {
    const RareLight found = rare_light(samples, true);
    EXPECT_GT(found.claimed, found.exact) << samples;
    EXPECT_LT(found.claimed, found.exact / 0.7) << samples;
  }
  EXPECT_LT(rare_light(2, false).claimed, rare_light(2, false).exact / 2);  // by the deviations alone
}

TEST(PixelAccumulator, EstimatesTheDeviationOfTheMeanFromHalves) {
  // Four samples of which one is in the half: |8 - 2| sqrt(1 * 3) / 4.
  PixelAccumulator all, half;
  half.add({8, 8, 8});
  for (const double value : {8.0, 1.0, 2.0, 3.0}) all.add({value, value, value});
  float deviation[3];
  all.write_deviation(half, deviation);
  for (const float one : deviation) EXPECT_NEAR(one, 6 * std::sqrt(3.0) / 4, 1e-6);
}

}  // namespace
}  // namespace tracer
