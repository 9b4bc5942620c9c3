#include "tracer/src/image_io/decode.h"

#include "tracer/src/image_io/exr_header.h"
#include "tracer/src/image_io/file_marks.h"
#include "tracer/src/image_io/open_image_io.h"

namespace tracer {

Decoded decode_as(PictureKind kind, std::span<const std::uint8_t> bytes, ColorSpace color_space,
                  const TextureImageLimits& limits) try {
  if (kind == PictureKind::jpeg && !ends_as_jpeg(bytes))
    return std::string("is truncated: it does not end as a JPEG does");
  if (kind == PictureKind::png && !ends_as_png(bytes))
    return std::string("is truncated: its last chunk is not within the file");
  if (kind == PictureKind::webp && webp_pixels(bytes) > limits.pixels)
    return "the limit pixels is " + std::to_string(limits.pixels) + ", it has " + std::to_string(webp_pixels(bytes));
  if (kind == PictureKind::openexr) {
    if (std::string refused = exr_refusal(bytes, limits); !refused.empty()) return refused;
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
  const std::optional<PictureKind> kind = picture_kind(bytes);
  if (!kind || *kind == PictureKind::tiff || *kind == PictureKind::webp)
    return std::string("is no PNG, JPEG, OpenEXR or Radiance HDR file: its first bytes are none of theirs");
  return decode_as(*kind, bytes, color_space.value_or(is_linear(*kind) ? ColorSpace::linear : ColorSpace::srgb),
                   limits);
}

}  // namespace tracer
