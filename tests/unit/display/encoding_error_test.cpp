// Encoding errors against comparisons of decoded files, and the errors of files against known images.
#include <gtest/gtest.h>

#include <array>
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

struct File {
  EncodingError error;
  DisplayImage image;  ///< as it is read
};

File file_of(const Image& image, Format format, const Output& output = {}) {
  const auto encoded = encode(image, format, output);
  EXPECT_TRUE(encoded) << name(format) << ": " << encoded.error();
  const auto file = read_image(encoded->bytes);
  EXPECT_TRUE(file) << name(format) << ": " << file.error();
  return {encoded->error, file->image};
}

struct Variant {
  const char* name;
  Format format;
  Output output;
};

std::vector<Variant> variants() {
  std::vector<Variant> list;
  const auto add = [&](const char* name, const auto& formats, void (*change)(Output&)) {
    for (const Format format : formats) change(list.emplace_back(Variant{name, format, {}}).output);
  };
  constexpr std::array lossy{Format::jpg, Format::webp};
  constexpr std::array displayed{Format::png, Format::png16, Format::tiff, Format::jpg, Format::webp};
  add("plain", all_formats, [](Output&) {});
  add("palette", std::array{Format::png}, [](Output& output) { output.palette = 16; });
  add("half", std::array{Format::exr}, [](Output& output) { output.half = true; });
  add("coarse", lossy, [](Output& output) { output.quality = 50; });
  add("exposed", displayed, [](Output& output) { output.exposure = 1.5; });
  add("scaled", displayed, [](Output& output) { output.overflow = Output::Overflow::scale; });
  add("reinhard", displayed, [](Output& output) { output.overflow = Output::Overflow::reinhard; });
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
    SCOPED_TRACE(std::string(name(variant.format)) + ", " + variant.name);
    const File file = file_of(image, variant.format, variant.output);
    const DisplayImage display = to_display(image, variant.output);
    EXPECT_NEAR(file.error.image, compare(display, file.image)->rmse, curve_accuracy);
    EXPECT_NEAR(file.error.worst_tile, worst_tile(display, file.image), curve_accuracy);
  }
}

TEST(EncodingError, OfLinearFormatsIsThatOfTheirDisplay) {
  const Image image = random_image(64, 48);
  Output output;
  output.exposure = -3;
  const File file = file_of(image, Format::hdr, output);
  // The reader displays the file as it is, clamped at 1, which the exposure makes 1/8.
  EXPECT_GT(file.error.image, 0);
  EXPECT_LT(file.error.image, compare(to_display(image), file.image)->rmse);
  EXPECT_EQ(file_of(image, Format::exr, output).error.image, 0);
}

TEST(EncodingError, IsTheSameForAnyNumberOfThreads) {
  const Image image = random_image(200, 300);
  for (const Format format : all_formats) {
    const auto with = [&](std::uint32_t threads) {
      EncodingError error;
      for_each_tile(1, threads, [&](std::uint64_t) { error = file_of(image, format).error; });
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

/// A smooth image with noise of a standard deviation.
struct WrongImage {
  Image truth, image;
  ErrorEstimate error;  ///< as it is, without a margin
};

WrongImage wrong_image(double noise) {
  constexpr std::uint32_t width = 256, height = 192;
  std::mt19937 random(11);
  std::normal_distribution<double> deviation(0, 1);
  const auto truth = [](std::size_t i) { return 20 + 200 * static_cast<double>(i / 3 % width) / width; };
  WrongImage wrong{image_of_levels(width, height, truth), {}, {}};
  wrong.image = image_of_levels(width, height, [&](std::size_t i) { return truth(i) + noise * deviation(random); });
  wrong.error = estimate_of(noise, noise);
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
      const WrongImage wrong = wrong_image(noise);
      const File file = file_of(wrong.image, format);
      const double found = compare(to_display(wrong.truth), file.image)->rmse;
      const double claimed = file_error(wrong.error, file.error).estimate;
      EXPECT_LE(found, 1.01 * claimed) << name(format) << ", noise " << noise;
      if (format == Format::png || format == Format::png16) {
        EXPECT_GE(found, 0.97 * claimed) << name(format) << ", noise " << noise;
      }
    }
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
  const File png = file_of(image, Format::png);
  const double found = compare(to_display(truth), png.image)->rmse;
  EXPECT_NEAR(found, 0.5, curve_accuracy + 1e-2);  // noise beyond a whole step is rare
  EXPECT_GE(file_error(estimate, png.error).proven, found);
  EXPECT_LT(file_error(estimate, png.error).estimate, found) << "the sum of squares is no bound";
}

}  // namespace
}  // namespace tracer
