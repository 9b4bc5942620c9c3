// Image decoding: valid files give their pixels, invalid files an error, with bounded time and memory.
#include "tracer/src/image_io/decode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/memory_growth.h"

namespace tracer {
namespace {

namespace fs = std::filesystem;

const fs::path corpus = WHITTLE_CORPUS "/image";

std::vector<std::uint8_t> bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  const std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  return {text.begin(), text.end()};
}

Image image_file(const std::string& name, std::optional<ColorSpace> space = {}) {
  auto image = decode(bytes_of(corpus / name), space, {});
  EXPECT_TRUE(image) << name << ": " << image.error();
  return image ? *std::move(image) : Image{1, 1, {0, 0, 0}};
}

std::string refusal(const std::string& name, const TextureImageLimits& limits = {}) {
  const auto image = decode(bytes_of(corpus / name), std::nullopt, limits);
  return image ? "" : image.error();
}

double linear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// The images of the corpus are 8 x 4: red grows with x, green with y from the top, blue is a quarter.
void expect_ramp(const Image& image, bool srgb, double tolerance) {
  ASSERT_EQ(image.width, 8u);
  ASSERT_EQ(image.height, 4u);
  const auto value = [&](double encoded) { return srgb ? linear(encoded) : encoded; };
  for (std::uint32_t y = 0; y < 4; ++y)
    for (std::uint32_t x = 0; x < 8; ++x) {
      EXPECT_NEAR(image.pixel(x, y)[0], value(x / 7.0), tolerance) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[1], value(y / 3.0), tolerance) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[2], value(0.25), tolerance) << x << " " << y;
    }
}

TEST(ImageDecoder, GivesLinearPixelsOfEveryKindOfFile) {
  expect_ramp(image_file("good_rgb.png"), true, 0.005);
  expect_ramp(image_file("good_16_bit.png"), true, 2e-5);
  expect_ramp(image_file("good_half.exr"), false, 3e-4);
  expect_ramp(image_file("good_tiled.exr"), false, 1e-7);
  expect_ramp(image_file("good_rgb.hdr"), false, 0.01);
  expect_ramp(image_file("good_rgb.jpg"), true, 0.35);  // a block of sixteen pixels shares its hue
}

TEST(ImageDecoder, UsesTheColorSpaceOfTheScene) {
  expect_ramp(image_file("good_16_bit.png", ColorSpace::linear), false, 2e-5);
  expect_ramp(image_file("good_tiled.exr", ColorSpace::srgb), true, 1e-6);
}

TEST(ImageDecoder, IgnoresAlpha) { expect_ramp(image_file("good_rgba.png"), true, 0.005); }

TEST(ImageDecoder, MakesThreeEqualChannelsOfGrey) {
  for (const char* name : {"good_grey.png", "good_grey_alpha.png", "good_grey.jpg"}) {
    const Image image = image_file(name);
    EXPECT_NEAR(image.pixel(7, 0)[0], 1, 0.05) << name;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      EXPECT_EQ(image.rgb[i], image.rgb[i + 1]) << name;
      EXPECT_EQ(image.rgb[i], image.rgb[i + 2]) << name;
    }
  }
}

TEST(ImageDecoder, ExpandsPalettes) {
  const Image image = image_file("good_palette.png");
  EXPECT_EQ(image.pixel(0, 0)[0], 1);
  EXPECT_EQ(image.pixel(1, 0)[0], 0);
  EXPECT_EQ(image.pixel(1, 0)[2], 1);
}

TEST(ImageDecoder, ConvertsCmykToRgb) {
  const Image image = image_file("good_cmyk.jpg");
  EXPECT_EQ(image.rgb.size(), 96u);
  EXPECT_NE(image.pixel(0, 0)[0], image.pixel(7, 0)[0]);
}

TEST(ImageDecoder, RejectsEveryInvalidFileWithinTimeAndMemory) {
  const MemoryGrowth growth;
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(corpus)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("bad_")) continue;
    ++files;
    EXPECT_NE(refusal(name), "") << name << " was taken for an image_file";
  }
  EXPECT_GE(files, 20u);
#ifndef WHITTLE_SANITIZED
  EXPECT_LT(growth.kibibytes(), 256 * 1024);
#endif
}

TEST(ImageDecoder, RejectsFormatsThatOnlyComparisonsRead) {
  for (const char* name : {"good_16_bit.tiff", "good_rgb.webp"})
    EXPECT_NE(refusal(name).find("no PNG, JPEG, OpenEXR or Radiance HDR"), std::string::npos) << name;
}

TEST(ImageDecoder, DescribesTheError) {
  EXPECT_NE(refusal("bad_no_image.txt").find("no PNG, JPEG, OpenEXR or Radiance HDR"), std::string::npos);
  EXPECT_NE(refusal("bad_other_reader.tif").find("no PNG, JPEG, OpenEXR or Radiance HDR"), std::string::npos);
  EXPECT_NE(refusal("bad_7000_x_9000.png").find("the limit bytes is 256000000"), std::string::npos);
  EXPECT_NE(refusal("bad_attribute_beyond_the_file.exr").find("has an attribute of 1879048191 bytes"),
            std::string::npos);
  EXPECT_NE(refusal("bad_1_x_1048576.exr").find("bytes for 65536 chunks"), std::string::npos);
  EXPECT_NE(refusal("bad_million_tiles.exr").find("bytes for 1048576 chunks"), std::string::npos);
  EXPECT_NE(refusal("bad_giant_tiles.exr").find("it has tiles of 262144 x 262160"), std::string::npos);
  EXPECT_NE(refusal("bad_100000_x_100000.exr").find("it has 100000 x 100000"), std::string::npos);
  EXPECT_NE(refusal("bad_nine_channels.exr").find("the limit channels is 8, it has 9"), std::string::npos);
  EXPECT_NE(refusal("bad_truncated_rgb.jpg").find("truncated"), std::string::npos);
  EXPECT_NE(refusal("bad_nan.exr").find("not finite at pixel (2, 1)"), std::string::npos);
  EXPECT_NE(refusal("good_rgb.png", {.pixels = 31}).find("the limit pixels is 31, it has 8 x 4"), std::string::npos);
}

}  // namespace
}  // namespace tracer
