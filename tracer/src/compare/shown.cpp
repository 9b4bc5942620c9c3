#include "tracer/shown.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracer/src/film/srgb.h"
#include "tracer/src/film/tone.h"
#include "tracer/src/image_io/decode.h"
#include "tracer/src/image_io/file_marks.h"

namespace tracer {
namespace {

float code_of_light(float linear) {
  if (!(linear > 0)) return 0;  // not-a-number too
  return linear >= 1 ? 65535 : static_cast<float>(65535 * srgb_from_linear(linear));
}

/// The decoder gives code / 65535, rounded to a float: the nearest whole number is the code.
float code_of_fraction(float fraction) { return static_cast<float>(std::lround(fraction * 65535.0)); }

}  // namespace

ShownPicture shown(const Image& image, const Output& output) {
  ShownPicture picture{image.width, image.height, image.rgb};
  apply_tone(picture.codes, output);
  std::transform(picture.codes.begin(), picture.codes.end(), picture.codes.begin(), code_of_light);
  return picture;
}

const char* name(PictureKind kind) {
  switch (kind) {
    case PictureKind::png:
      return "PNG";
    case PictureKind::jpeg:
      return "JPEG";
    case PictureKind::openexr:
      return "OpenEXR";
    case PictureKind::hdr:
      return "Radiance HDR";
    case PictureKind::tiff:
      return "TIFF";
    case PictureKind::webp:
      return "WebP";
  }
  return "";
}

Result<PictureFile, std::string> read_picture(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) {
  const auto kind = picture_kind(bytes);
  if (!kind) return std::string("is no PNG, JPEG, TIFF, WebP, OpenEXR or Radiance HDR file");
  auto image = decode_as(*kind, bytes, ColorSpace::linear, limits);  // linear: values as they are in the file
  if (!image) return std::move(image.error());
  PictureFile file{{image->width, image->height, std::move(image->rgb)}, *kind};
  std::vector<float>& codes = file.picture.codes;
  std::transform(codes.begin(), codes.end(), codes.begin(), is_linear(*kind) ? code_of_light : code_of_fraction);
  return file;
}

}  // namespace tracer
