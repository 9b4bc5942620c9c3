#pragma once
/// Checks of image files before a library reads them: format, completeness, size.

#include <cstdint>
#include <optional>
#include <span>

#include "tracer/display_image.h"

namespace tracer {

/// Format by the file's first bytes; nothing for other files.
std::optional<ImageFormat> image_kind(std::span<const std::uint8_t> bytes);

/// True if the file ends with the JPEG end marker. libjpeg fills missing data with gray and only warns.
bool ends_as_jpeg(std::span<const std::uint8_t> bytes);

/// True if the chunks are contiguous up to the last, all within the file. (ISO 15948, sec. 5.3: length, type, content,
/// check.) On truncated files OpenImageIO's reader jumps out of libpng over its own strings, which leak.
bool has_png_trailer(std::span<const std::uint8_t> bytes);

/// Number of pixels in the header of a WebP file, for which the library allocates memory when it opens the file; 0 if
/// there is none. Precondition: image_kind(bytes) is webp.
std::uint64_t webp_pixels(std::span<const std::uint8_t> bytes);

}  // namespace tracer
