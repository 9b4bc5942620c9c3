#include "tracer/display_image.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracer/src/display/srgb.h"
#include "tracer/src/display/tone_mapping.h"
#include "tracer/src/image_io/decode.h"

namespace tracer {
namespace {

float code_of_light(float linear) {
  if (!(linear > 0)) return 0;  // not-a-number too
  return linear >= 1 ? 65535 : static_cast<float>(65535 * srgb_from_linear(linear));
}

/// The decoder returns code / 65535 as a float: rounding to the nearest integer restores the code.
float code_of_fraction(float fraction) { return static_cast<float>(std::lround(fraction * 65535.0)); }

}  // namespace

DisplayImage to_display(const Image& image, const Output& output) {
  DisplayImage display{image.width, image.height, image.rgb};
  apply_tone(display.codes, output);
  std::transform(display.codes.begin(), display.codes.end(), display.codes.begin(), code_of_light);
  return display;
}

const char* name(ImageFormat kind) {
  constexpr const char* names[] = {"PNG", "JPEG", "OpenEXR", "Radiance HDR", "TIFF", "WebP"};
  return names[static_cast<std::size_t>(kind)];
}

Result<ImageFile, std::string> read_image(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) {
  const auto kind = image_kind(bytes);
  if (!kind) return std::string("is no PNG, JPEG, TIFF, WebP, OpenEXR or Radiance HDR file");
  auto image = decode_as(*kind, bytes, ColorSpace::linear, limits);  // linear: values as they are in the file
  if (!image) return std::move(image.error());
  ImageFile file{{image->width, image->height, std::move(image->rgb)}, *kind};
  std::vector<float>& codes = file.image.codes;
  std::transform(codes.begin(), codes.end(), codes.begin(), is_linear(*kind) ? code_of_light : code_of_fraction);
  return file;
}

}  // namespace tracer
