#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tracer/compare.h"
#include "tracer/encode.h"
#include "tracer/src/compare/scaling.h"
#include "tracer/src/display/srgb.h"

namespace tracer {
namespace {

Image scaled(const DisplayImage& source, std::uint32_t width, std::uint32_t height) {
  std::vector<float> linear_from_code(65536);
  for (std::size_t code = 0; code < linear_from_code.size(); ++code)
    linear_from_code[code] = static_cast<float>(linear_from_srgb(static_cast<double>(code) / 65535));
  Image image{.width = width, .height = height, .rgb = {}};
  image.rgb.reserve(std::size_t{3} * width * height);
  for (std::uint32_t y = 0; y < height; ++y) {
    const auto [top, bottom] = covered_pixels(y, height, source.height);
    for (std::uint32_t x = 0; x < width; ++x) {
      const auto [left, right] = covered_pixels(x, width, source.width);
      const double area = static_cast<double>(bottom - top) * (right - left);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        double sum = 0;
        for (std::size_t row = top; row < bottom; ++row)
          for (std::size_t column = left; column < right; ++column)
            sum += linear_from_code[static_cast<std::size_t>(
                std::lround(source.codes[3 * (row * source.width + column) + channel]))];
        image.rgb.push_back(static_cast<float>(sum / area));
      }
    }
  }
  return image;
}

}  // namespace

Result<std::vector<std::uint8_t>, std::string> thumbnail(std::span<const std::uint8_t> bytes, std::uint32_t side) {
  const auto file = read_image(bytes);
  if (!file) return file.error();
  const DisplayImage& source = file->image;
  const std::uint32_t longer = std::max(source.width, source.height);
  const auto length = [&](std::uint32_t pixels) { return reduced_length(pixels, longer, side); };
  auto png = encode(scaled(source, length(source.width), length(source.height)), Format::png);
  if (!png) return png.error();
  return std::move(png->bytes);
}

}  // namespace tracer
