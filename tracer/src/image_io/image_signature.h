#pragma once
/// What the bytes of an image file say of it before any library reads them.

#include <cstdint>
#include <optional>
#include <span>

#include "tracer/display_image.h"

namespace tracer {

/// By the file's first bytes alone; nothing when they are no such file's.
std::optional<ImageFormat> image_kind(std::span<const std::uint8_t> bytes);

/// libjpeg fills what is missing with grey and calls it a warning: what does not end as a JPEG does is truncated.
bool ends_as_jpeg(std::span<const std::uint8_t> bytes);

/// Whether the chunks follow one another to the last, all within the file. (ISO 15948, sec. 5.3: length, type, content,
/// check.) At the end of its bytes OpenImageIO's reader jumps out of libpng over its own strings, which leak.
bool has_png_trailer(std::span<const std::uint8_t> bytes);

/// How many pixels a WebP file says that it has; the library makes room for all of them as it opens it. 0 where it does
/// not say. Precondition: image_kind(bytes) is webp.
std::uint64_t webp_pixels(std::span<const std::uint8_t> bytes);

}  // namespace tracer
