// Encoding errors against comparisons of decoded files, and the errors of files against known images.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracer/compare.h"
#include "tracer/encode.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr double curve_accuracy = 2e-4;  // levels; see encoding_error.h

/// Radiance from black to a little above white.
Image random_image(std::uint32_t width, std::uint32_t height) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> radiance(0, 1.05F);
  Image image{.width = width, .height = height, .rgb = std::vector<float>(std::size_t{3} * width * height)};
  for (float& value : image.rgb) value = radiance(random);
  return image;
}

/// The image whose display values, in levels, are `level(i)`.
template <class Level>
Image image_of_levels(std::uint32_t width, std::uint32_t height, const Level& level) {
  Image image{.width = width, .height = height, .rgb = std::vector<float>(std::size_t{3} * width * height)};
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = static_cast<float>(linear_from_srgb(level(i) / 255));
  return image;
}

EncodingError error_of(const Image& image, Format format, const Output& output = {}) {
  const auto encoded = encode(image, format, output);
  EXPECT_TRUE(encoded) << encoded.error();
  return encoded->error;
}

struct Variant {
  const char* name;
  Format format;
  Output output;
};

std::vector<Variant> variants() {
  Output palette, exposed, scaled, reinhard, half, coarse;
  palette.palette = 16;
  half.half = true;
  coarse.quality = 50;
  exposed.exposure = 1.5;
  scaled.overflow = Output::Overflow::scale;
  reinhard.overflow = Output::Overflow::reinhard;
  std::vector<Variant> list;
  for (const Format format : all_formats) list.push_back({"plain", format, {}});
  list.push_back({"palette", Format::png, palette});
  list.push_back({"half", Format::exr, half});
  list.push_back({"coarse", Format::jpg, coarse});
  list.push_back({"coarse", Format::webp, coarse});
  for (const Format format : {Format::png, Format::png16, Format::tiff, Format::jpg, Format::webp})
    for (const auto& [name, output] : {std::pair{"exposed", exposed}, {"scaled", scaled}, {"reinhard", reinhard}})
      list.push_back({name, format, output});
  return list;
}

/// Largest root mean square difference of a tile, by its definition.
double worst_tile(const DisplayImage& a, const DisplayImage& b) {
  double worst = 0;
  for (std::uint32_t top = 0; top < a.height; top += 16)
    for (std::uint32_t left = 0; left < a.width; left += 16) {
      double sum = 0, count = 0;
      for (std::uint32_t y = top; y < std::min(top + 16, a.height); ++y)
        for (std::size_t i = 3 * (std::size_t{y} * a.width + left);
             i < 3 * (std::size_t{y} * a.width + std::min(left + 16, a.width)); ++i) {
          sum += std::pow((a.codes[i] - b.codes[i]) / codes_per_level, 2);
          ++count;
        }
      worst = std::max(worst, std::sqrt(sum / count));
    }
  return worst;
}

TEST(EncodingError, IsTheDifferenceOfTheDecodedFileToTheDisplayedImage) {
  const Image image = random_image(83, 45);  // partial tiles at both borders
  for (const Variant& variant : variants()) {
    const auto encoded = encode(image, variant.format, variant.output);
    ASSERT_TRUE(encoded) << encoded.error();
    const auto file = read_image(encoded->bytes);
    ASSERT_TRUE(file) << file.error();
    const DisplayImage display = to_display(image, variant.output);
    const std::string what = std::string(name(variant.format)) + ", " + variant.name;
    EXPECT_NEAR(encoded->error.image, compare(display, file->image)->rmse, curve_accuracy) << what;
    EXPECT_NEAR(encoded->error.worst_tile, worst_tile(display, file->image), curve_accuracy) << what;
  }
}

TEST(EncodingError, OfLinearFormatsIsThatOfTheirDisplay) {
  const Image image = random_image(64, 48);
  Output output;
  output.exposure = -3;
  const auto encoded = encode(image, Format::hdr, output);
  ASSERT_TRUE(encoded);
  const auto file = read_image(encoded->bytes);
  ASSERT_TRUE(file);
  // The reader displays the file as it is, clamped at 1, which the exposure makes 1/8.
  EXPECT_GT(encoded->error.image, 0);
  EXPECT_LT(encoded->error.image, compare(to_display(image), file->image)->rmse);
  EXPECT_EQ(error_of(image, Format::exr, output).image, 0);
}

TEST(EncodingError, OfRoundingIsARootOfTwelfthOfAStep) {
  const Image image = image_of_levels(
      512, 512, [](std::size_t i) { return 255 * std::fmod(static_cast<double>(i) * 0.6180339887, 1.0); });
  EXPECT_NEAR(error_of(image, Format::png).image, std::sqrt(1 / 12.0), 1e-3);
  EXPECT_NEAR(error_of(image, Format::png16).image, std::sqrt(1 / 12.0) / codes_per_level, curve_accuracy);
}

TEST(EncodingError, IsTheSameForAnyNumberOfThreads) {
  const Image image = random_image(200, 300);
  for (const Format format : all_formats) {
    const auto with = [&](std::uint32_t threads) {
      EncodingError error;
      for_each_tile(1, threads, [&](std::uint64_t) { error = error_of(image, format); });
      return error;
    };
    const EncodingError one = with(1), two = with(2);
    EXPECT_EQ(one.image, two.image) << name(format);
    EXPECT_EQ(one.worst_tile, two.worst_tile) << name(format);
  }
}

ErrorEstimate estimate_of(double estimate, double sampling) {
  ErrorEstimate error;
  error.estimate = estimate;
  error.sampling = sampling;
  return error;
}

TEST(FileError, AddsNoiseBySquaresAndFixedPartsByTheirSize) {
  const EncodingError encoding{0.75, 2};
  EXPECT_DOUBLE_EQ(file_error(estimate_of(1, 1), encoding).estimate, 1.25);
  EXPECT_DOUBLE_EQ(file_error(estimate_of(1, 0), encoding).estimate, 1.75);
  const double both = file_error(estimate_of(1, 0.6), encoding).estimate;  // fixed: 0.8
  EXPECT_DOUBLE_EQ(both * both, 0.6 * 0.6 + (0.8 + 0.75) * (0.8 + 0.75));
  EXPECT_DOUBLE_EQ(file_error(estimate_of(1, 0.6), {}).estimate, 1);
  EXPECT_EQ(file_error(estimate_of(1, 1), encoding).encoding, 0.75);
}

TEST(FileError, AddsBoundsByTheTriangleInequality) {
  ErrorEstimate image = estimate_of(1, 1);
  EXPECT_TRUE(std::isinf(file_error(image, {0.25, 0.5}).proven));
  image.proven = 2;
  image.worst_tile = 3;
  const FileError file = file_error(image, {0.25, 0.5});
  EXPECT_EQ(file.proven, 2.25);
  EXPECT_EQ(file.worst_tile, 3.5);
}

TEST(FileError, ReachesATargetOnlyWithTheFile) {
  ErrorEstimate image = estimate_of(1, 1);
  EXPECT_TRUE(file_error(image, {10, 10}).target_met) << "no target";
  image.target = 1.1;
  EXPECT_TRUE(file_error(image, {0.25, 10}).target_met);
  EXPECT_FALSE(file_error(image, {0.5, 10}).target_met);
  image.worst_tile = 3;
  image.tile_target = 4;
  EXPECT_TRUE(file_error(image, {0.25, 1}).target_met);
  EXPECT_FALSE(file_error(image, {0.25, 1.5}).target_met);
}

/// A smooth image with an error: noise of a standard deviation, and a constant difference.
struct WrongImage {
  Image truth, image;
  ErrorEstimate error;  ///< as it is, without a margin
};

WrongImage wrong_image(double noise, double difference) {
  constexpr std::uint32_t width = 256, height = 192;
  std::mt19937 random(11);
  std::normal_distribution<double> deviation(0, 1);
  const auto truth = [](std::size_t i) { return 20 + 200 * static_cast<double>(i / 3 % width) / width; };
  WrongImage wrong{image_of_levels(width, height, truth), {}, {}};
  wrong.image =
      image_of_levels(width, height, [&](std::size_t i) { return truth(i) + noise * deviation(random) + difference; });
  wrong.error = estimate_of(std::hypot(noise, difference), noise);
  return wrong;
}

TEST(Encode, RefusesSidesThatAFormatCannotHold) {
  for (const Format format : all_formats) {
    const std::uint32_t longest = std::min(row(format).side_max, std::uint32_t{65'536});
    EXPECT_TRUE(encode(Image{longest, 1, std::vector<float>(3 * longest)}, format)) << name(format);
    if (longest < row(format).side_max) continue;
    const std::uint32_t longer = longest + 1;
    EXPECT_FALSE(encode(Image{longer, 1, std::vector<float>(3 * longer)}, format)) << name(format);
    EXPECT_FALSE(encode(Image{1, longer, std::vector<float>(3 * longer)}, format)) << name(format);
  }
}

TEST(FileError, IsThatOfTheDecodedFileOfANoisyImage) {
  for (const Format format : {Format::png, Format::png16, Format::jpg, Format::webp})
    for (const double noise : {0.1, 0.25, 0.5, 1.0, 2.0}) {
      const WrongImage wrong = wrong_image(noise, 0);
      const auto encoded = encode(wrong.image, format);
      ASSERT_TRUE(encoded);
      const double found = compare(to_display(wrong.truth), read_image(encoded->bytes)->image)->rmse;
      const double claimed = file_error(wrong.error, encoded->error).estimate;
      EXPECT_LE(found, 1.01 * claimed) << name(format) << ", noise " << noise;
      if (format == Format::png || format == Format::png16) {
        EXPECT_GE(found, 0.97 * claimed) << name(format) << ", noise " << noise;
      }
    }
}

TEST(FileError, CoversADifferenceInTheDirectionOfTheRounding) {
  // Every value is a quarter of a level above the truth, and rounding adds a quarter.
  const Image truth = image_of_levels(64, 64, [](std::size_t i) { return 50.5 + static_cast<double>(i % 100); });
  const Image image = image_of_levels(64, 64, [](std::size_t i) { return 50.75 + static_cast<double>(i % 100); });
  const auto png = encode(image, Format::png);
  ASSERT_TRUE(png);
  const double found = compare(to_display(truth), read_image(png->bytes)->image)->rmse;
  EXPECT_NEAR(found, 0.5, curve_accuracy);
  EXPECT_NEAR(file_error(estimate_of(0.25, 0), png->error).estimate, 0.5, curve_accuracy);
}

TEST(FileError, IsProvenForNoiseThatIsCorrelatedWithTheRounding) {
  // Every true value is half-way between two codes, so rounding moves each away from it.
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.15);
  const Image truth = image_of_levels(64, 64, [](std::size_t) { return 127.5; });
  const Image image = image_of_levels(64, 64, [&](std::size_t) { return 127.5 + noise(random); });
  const double of_image = compare(to_display(truth), to_display(image))->rmse;
  ErrorEstimate estimate = estimate_of(of_image, of_image);
  estimate.proven = of_image;
  const auto png = encode(image, Format::png);
  ASSERT_TRUE(png);
  const double found = compare(to_display(truth), read_image(png->bytes)->image)->rmse;
  EXPECT_NEAR(found, 0.5, curve_accuracy + 1e-2);  // noise beyond a whole step is rare
  EXPECT_GE(file_error(estimate, png->error).proven, found);
  EXPECT_LT(file_error(estimate, png->error).estimate, found) << "the sum of squares is no bound";
}

}  // namespace
}  // namespace tracer
