// Image decoding: valid files give their pixels, invalid files an error, with bounded time and memory.
#include "tracer/src/image_io/decode.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/memory_growth.h"
#include "tracer/src/display/srgb.h"

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

/// The images of the corpus are 8 x 4: red grows with x, green with y from the top, blue is a quarter.
void expect_ramp(const Image& image, bool srgb, double tolerance) {
  ASSERT_EQ(image.width, 8u);
  ASSERT_EQ(image.height, 4u);
  const auto value = [&](double encoded) { return srgb ? linear_from_srgb(encoded) : encoded; };
  for (std::uint32_t y = 0; y < 4; ++y)
    for (std::uint32_t x = 0; x < 8; ++x) {
      EXPECT_NEAR(image.pixel(x, y)[0], value(x / 7.0), tolerance) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[1], value(y / 3.0), tolerance) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[2], value(0.25), tolerance) << x << " " << y;
    }
}

TEST(ImageDecoder, GivesLinearPixelsOfEveryKindOfFileWithoutAlpha) {
  struct File {
    const char* name;
    bool srgb;
    double tolerance;
    std::optional<ColorSpace> given = {};
  };
  for (const auto& [name, srgb, tolerance, given] :
       {File{"good_rgb.png", true, 0.005}, File{"good_rgba.png", true, 0.005}, File{"good_16_bit.png", true, 2e-5},
        File{"good_half.exr", false, 3e-4}, File{"good_tiled.exr", false, 1e-7}, File{"good_rgb.hdr", false, 0.01},
        File{"good_rgb.jpg", true, 0.35},  // a block of sixteen pixels shares its hue
        File{"good_16_bit.png", false, 2e-5, ColorSpace::linear},
        File{"good_tiled.exr", true, 1e-6, ColorSpace::srgb}}) {
    SCOPED_TRACE(name);
    expect_ramp(image_file(name, given), srgb, tolerance);
  }
}

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

TEST(ImageDecoder, DescribesTheError) {
  const std::string unknown = "no PNG, JPEG, OpenEXR or Radiance HDR";  // TIFF and WebP are read by comparisons only
  const std::pair<const char*, std::string> reasons[] = {
      {"good_16_bit.tiff", unknown},
      {"good_rgb.webp", unknown},
      {"bad_no_image.txt", unknown},
      {"bad_other_reader.tif", unknown},
      {"bad_7000_x_9000.png", "the limit bytes is 256000000"},
      {"bad_attribute_beyond_the_file.exr", "has an attribute of 1879048191 bytes"},
      {"bad_1_x_1048576.exr", "bytes for 65536 chunks"},
      {"bad_million_tiles.exr", "bytes for 1048576 chunks"},
      {"bad_giant_tiles.exr", "it has tiles of 262144 x 262160"},
      {"bad_100000_x_100000.exr", "it has 100000 x 100000"},
      {"bad_nine_channels.exr", "the limit channels is 8, it has 9"},
      {"bad_truncated_rgb.jpg", "truncated"},
      {"bad_nan.exr", "not finite at pixel (2, 1)"},
  };
  for (const auto& [name, reason] : reasons) EXPECT_NE(refusal(name).find(reason), std::string::npos) << refusal(name);
  EXPECT_NE(refusal("good_rgb.png", {.pixels = 31}).find("the limit pixels is 31, it has 8 x 4"), std::string::npos);
}

}  // namespace
}  // namespace tracer
