// Display images: exact codes of files, and codes of radiance compared with the curve in long double.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tracer/compare.h"
#include "tracer/encode.h"

namespace tracer {
namespace {

long double curve(long double linear) {
  return linear <= 0.0031308L ? 12.92L * linear : 1.055L * std::pow(linear, 1 / 2.4L) - 0.055L;
}

/// One row of light from -0.1 to 1.1, grey.
Image ramp() {
  Image image{.width = 256, .height = 1, .rgb = {}};
  for (int i = 0; i < 256; ++i) image.rgb.insert(image.rgb.end(), 3, static_cast<float>(-0.1 + 1.2 * i / 255));
  return image;
}

TEST(DisplayImage, IsTheCurveOfClampedLightNotRoundedToCodes) {
  const Image image = ramp();
  const DisplayImage display = to_display(image);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const long double linear = std::fmin(std::fmax(image.rgb[i], 0.0F), 1.0F);
    ASSERT_FLOAT_EQ(display.codes[i], static_cast<float>(65535 * curve(linear))) << image.rgb[i];
  }
  EXPECT_EQ(display.codes.front(), 0);
  EXPECT_EQ(display.codes.back(), 65535);
}

TEST(DisplayImage, OfNanIsBlackAndOfInfinityWhite) {
  const float infinity = std::numeric_limits<float>::infinity();
  const DisplayImage display = to_display({.width = 1, .height = 1, .rgb = {std::nanf(""), infinity, -infinity}});
  EXPECT_EQ(display.codes, (std::vector<float>{0, 65535, 0}));
}

ImageFile read(const Image& image, Format format) {
  const auto encoded = encode(image, format);
  EXPECT_TRUE(encoded);
  auto file = read_image(encoded->bytes);
  EXPECT_TRUE(file) << name(format) << ": " << file.error();
  return file ? *std::move(file) : ImageFile{{1, 1, {0, 0, 0}}, ImageFormat::png};
}

TEST(ImageFile, GivesTheCodesOfEightAndSixteenBitsExactly) {
  const Image image = ramp();
  const ImageFile eight = read(image, Format::png), sixteen = read(image, Format::png16),
                  tiff = read(image, Format::tiff);
  EXPECT_EQ(tiff.image.codes, sixteen.image.codes);
  EXPECT_EQ(tiff.kind, ImageFormat::tiff);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const long double fraction = curve(std::fmin(std::fmax(image.rgb[i], 0.0F), 1.0F));
    EXPECT_EQ(eight.image.codes[i], 257 * std::floor(255 * fraction + 0.5L));
    EXPECT_EQ(sixteen.image.codes[i], std::floor(65535 * fraction + 0.5L));
  }
}

TEST(ImageFile, OfALossyFormatIsCloseToItsImage) {
  const Image image{.width = 64, .height = 64, .rgb = std::vector<float>(std::size_t{3} * 64 * 64, 0.3F)};
  const float grey = to_display(image).codes[0];
  for (const auto& [format, kind] : {std::pair{Format::jpg, ImageFormat::jpeg}, {Format::webp, ImageFormat::webp}}) {
    const ImageFile file = read(image, format);
    EXPECT_EQ(file.kind, kind);
    EXPECT_EQ(file.image.width, 64u);
    for (const float code : file.image.codes) ASSERT_NEAR(code, grey, 2 * 257) << name(format);
  }
}

TEST(ImageFile, OfLinearRadianceIsEncodedAsSrgbWithoutOrWithLayers) {
  Image image = ramp();
  EXPECT_EQ(read(image, Format::hdr).kind, ImageFormat::hdr);
  EXPECT_EQ(read(image, Format::exr).kind, ImageFormat::openexr);
  EXPECT_EQ(read(image, Format::exr).image.codes, to_display(image).codes);
  image.alpha = image.layers.depth = std::vector<float>(256, 1);
  image.layers.normal = image.layers.albedo = std::vector<float>(std::size_t{3} * 256, 1);
  image.layers.object_id = image.layers.samples = std::vector<std::uint32_t>(256, 7);
  EXPECT_EQ(read(image, Format::exr).image.codes, to_display(ramp()).codes);
}

std::string refusal(std::vector<std::uint8_t> bytes, const TextureImageLimits& limits = compared_file_limits) {
  const auto file = read_image(bytes, limits);
  return file ? "" : file.error();
}

TEST(ImageFile, IsRejectedIfTruncatedAnywhere) {
  Image image{.width = 16, .height = 8, .rgb = {}};
  for (int i = 0; i < 16 * 8 * 3; ++i) image.rgb.push_back(static_cast<float>(i % 97) / 97);
  for (const Format format : all_formats) {
    const std::vector<std::uint8_t> bytes = encode(image, format)->bytes;
    for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 16) {
      const std::vector<std::uint8_t> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_NE(refusal(part), "") << name(format) << " of " << size << " of " << bytes.size() << " bytes";
    }
  }
}

TEST(ImageFile, IsRejectedAboveThePixelLimitInEveryFormat) {
  for (const Format format : all_formats)
    EXPECT_NE(refusal(encode(ramp(), format)->bytes, {.pixels = 255}).find("the limit pixels is 255"),
              std::string::npos)
        << name(format);
  EXPECT_EQ(refusal(encode(ramp(), Format::png)->bytes, {.pixels = 256}), "");
}

TEST(ImageFile, RejectsWebpByTheSizeInItsFirstChunk) {
  std::vector<std::uint8_t> extended{'R', 'I', 'F', 'F', 22, 0, 0, 0, 'W', 'E', 'B', 'P', 'V', 'P', '8', 'X'};
  extended.insert(extended.end(), {10, 0, 0, 0, 0, 0, 0, 0, 0xff, 0x3f, 0, 0xff, 0x3f, 0});  // 16384 x 16384
  EXPECT_NE(refusal(extended).find("the limit pixels is 67108864, it has 268435456"), std::string::npos);
  std::vector<std::uint8_t> lossless{'R', 'I', 'F', 'F', 22, 0, 0, 0, 'W', 'E', 'B', 'P', 'V', 'P', '8', 'L'};
  lossless.insert(lossless.end(), {10, 0, 0, 0, 0x2f, 0xff, 0xff, 0xff, 0x0f, 0, 0, 0, 0, 0});  // as large
  EXPECT_NE(refusal(lossless).find("it has 268435456"), std::string::npos);
}

}  // namespace
}  // namespace tracer
