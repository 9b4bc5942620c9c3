/// Arbitrary bytes as a texture image, and as an image to compare: must neither crash nor hang, and the result must be
/// complete and within its range.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/fuzz/require.h"
#include "tracer/compare.h"
#include "tracer/src/image_io/decode.h"

namespace {

// Few pixels: AddressSanitizer turns milliseconds into seconds, for example for a TIFF of 5,000 strips.
constexpr tracer::TextureImageLimits limits{.pixels = 1 << 16, .channels = 8, .bytes = 1 << 22};

void decode(const std::vector<std::uint8_t>& bytes) {
  const auto image = tracer::decode(bytes, std::nullopt, limits);
  if (!image) return require(!image.error().empty(), "a refusal has a sentence");
  require(image->width > 0 && image->height > 0, "an image has pixels");
  require(image->rgb.size() == std::size_t{3} * image->width * image->height, "an image has all of them");
  for (const float value : image->rgb) require(std::isfinite(value) && value >= 0, "values are finite and >= 0");
}

void read_image(const std::vector<std::uint8_t>& bytes) {
  const auto file = tracer::read_image(bytes, limits);
  if (!file) return require(!file.error().empty(), "a refusal has a sentence");
  const tracer::DisplayImage& image = file->image;
  require(image.width > 0 && image.height > 0, "an image has pixels");
  require(image.codes.size() == std::size_t{3} * image.width * image.height, "an image has all of them");
  for (const float code : image.codes) require(code >= 0 && code <= 65535, "codes are from 0 to 65535");
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> bytes(data, data + size);  // of exactly this size: reading beyond its end is seen
  decode(bytes);
  read_image(bytes);
  return 0;
}
