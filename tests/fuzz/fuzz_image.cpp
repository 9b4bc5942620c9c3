/// Any bytes at all as a texture's picture: they must neither crash nor hang, and what comes out is whole and finite.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tracer/src/image_io/decode.h"

namespace {

void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> bytes(data, data + size);  // of exactly this size: reading beyond its end is seen
  const auto image = tracer::decode(bytes, std::nullopt, {.pixels = 1 << 20, .channels = 8, .bytes = 1 << 24});
  if (!image) {
    require(!image.error().empty(), "a refusal has a sentence");
    return 0;
  }
  require(image->width > 0 && image->height > 0, "a picture has pixels");
  require(image->rgb.size() == std::size_t{3} * image->width * image->height, "a picture has all of them");
  for (const float value : image->rgb) require(std::isfinite(value) && value >= 0, "values are finite and >= 0");
  return 0;
}
