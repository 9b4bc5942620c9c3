#include "tracer/src/image_io/decode.h"

#include "tracer/src/image_io/exr_header.h"
#include "tracer/src/image_io/image_signature.h"
#include "tracer/src/image_io/oiio_loader.h"

namespace tracer {

Decoded decode_as(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace color_space,
                  const TextureImageLimits& limits) try {
  if (kind == ImageFormat::jpeg && !ends_as_jpeg(bytes))
    return std::string("is truncated: it does not end as a JPEG does");
  if (kind == ImageFormat::png && !has_png_trailer(bytes))
    return std::string("is truncated: its last chunk is not within the file");
  if (kind == ImageFormat::webp && webp_pixels(bytes) > limits.pixels)
    return "the limit pixels is " + std::to_string(limits.pixels) + ", it has " + std::to_string(webp_pixels(bytes));
  if (kind == ImageFormat::openexr) {
    if (std::string error = exr_header_error(bytes, limits); !error.empty()) return error;
  }
  const auto library = open_image_io();
  if (!library) return library.error();
  return (*library)->read(kind, bytes, color_space, limits);
} catch (const std::bad_alloc&) {
  return std::string("takes more memory than there is");
} catch (const std::exception& failure) {
  return std::string("cannot be read: ") + failure.what();
}

Decoded decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
               const TextureImageLimits& limits) {
  if (bytes.empty()) return std::string("is empty");
  const std::optional<ImageFormat> kind = image_kind(bytes);
  if (!kind || *kind == ImageFormat::tiff || *kind == ImageFormat::webp)
    return std::string("is no PNG, JPEG, OpenEXR or Radiance HDR file: its first bytes are none of theirs");
  return decode_as(*kind, bytes, color_space.value_or(is_linear(*kind) ? ColorSpace::linear : ColorSpace::srgb),
                   limits);
}

}  // namespace tracer
