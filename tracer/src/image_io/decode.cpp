#include "tracer/src/image_io/decode.h"

#include <string_view>

#include "tracer/src/image_io/exr_header.h"
#include "tracer/src/image_io/oiio_loader.h"

namespace tracer {
namespace {

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Little-endian integer of `count` bytes at `at`.
std::uint64_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8U | bytes[at + i];
  return value;
}

/// True if the file ends with the JPEG end marker. libjpeg fills missing data with gray and only warns.
bool ends_as_jpeg(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty() && bytes.back() == 0) bytes = bytes.first(bytes.size() - 1);  // padding
  return bytes.size() >= 4 && bytes[bytes.size() - 2] == 0xff && bytes.back() == 0xd9;
}

/// True if the chunks are contiguous up to the last, all within the file. (ISO 15948, sec. 5.3: length, type, content,
/// check.) On truncated files OpenImageIO's reader jumps out of libpng over its own strings, which leak.
bool has_png_trailer(std::span<const std::uint8_t> bytes) {
  std::size_t at = 8;
  while (bytes.size() >= at + 12) {
    std::uint64_t length = 0;
    for (std::size_t i = at; i < at + 4; ++i) length = length << 8U | bytes[i];
    if (length > bytes.size() - at - 12) return false;
    if (bytes[at + 4] == 'I' && bytes[at + 5] == 'E' && bytes[at + 6] == 'N' && bytes[at + 7] == 'D') return true;
    at += length + 12;
  }
  return false;
}

/// Number of pixels in the header of a WebP file, for which the library allocates memory when it opens the file; 0 if
/// there is none. WebP container specification (RFC 9649), sections 2.5-2.7: the first chunk contains the size, in one
/// of three formats.
std::uint64_t webp_pixels(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 30) return 0;
  const std::string_view chunk = text_of(bytes.subspan(12, 4));
  if (chunk == "VP8X") return (little_endian(bytes, 24, 3) + 1) * (little_endian(bytes, 27, 3) + 1);
  if (chunk == "VP8 ") return (little_endian(bytes, 26, 2) & 0x3fffU) * (little_endian(bytes, 28, 2) & 0x3fffU);
  if (chunk != "VP8L") return 0;
  const std::uint64_t sizes = little_endian(bytes, 21, 4);
  return ((sizes & 0x3fffU) + 1) * ((sizes >> 14U & 0x3fffU) + 1);
}

}  // namespace

std::optional<ImageFormat> image_kind(std::span<const std::uint8_t> bytes) {
  using namespace std::string_view_literals;
  const std::string_view text = text_of(bytes);
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return ImageFormat::png;
  if (text.starts_with("\xff\xd8\xff")) return ImageFormat::jpeg;
  if (text.starts_with("\x76\x2f\x31\x01")) return ImageFormat::openexr;
  if (text.starts_with("#?RADIANCE") || text.starts_with("#?RGBE")) return ImageFormat::hdr;
  if (text.starts_with("II*\0"sv) || text.starts_with("MM\0*"sv)) return ImageFormat::tiff;
  if (text.starts_with("RIFF") && text.substr(0, 12).ends_with("WEBP")) return ImageFormat::webp;
  return std::nullopt;
}

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
