#include "tracer/src/image_io/decode.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tracer/limits.h"

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

constexpr std::uint32_t flag_multipart = 0x1000;

/// Rows per chunk, indexed by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::array<std::uint64_t, 10> chunk_rows{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

struct HeaderError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Validates the header of an OpenEXR file before OpenEXR reads it: the library allocates memory for an attribute of
/// two gigabytes, or for the chunk table of 2^31 rows, declared in a file of four hundred bytes. (OpenEXR File Layout,
/// openexr.com: a version, headers of attributes, and for each header a table of eight bytes per chunk.)
class ExrHeader {
 public:
  ExrHeader(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) : left_(bytes), limits_(limits) {}

  /// Throws HeaderError unless everything that the header declares is in the file and within the limits.
  void check() {
    take(4);
    const bool multipart = (number() & flag_multipart) != 0;
    std::uint64_t chunks = 0;
    do {
      part_ = {};
      while (!at_end_of_part()) attribute();
      chunks += part_.chunks();
    } while (multipart && !at_end_of_part());
    if (chunks > left_.size() / 8)
      throw HeaderError("is truncated: it has " + std::to_string(left_.size()) + " bytes for " +
                        std::to_string(chunks) + " chunks");
  }

 private:
  /// Attributes of one header that determine how much memory OpenEXR allocates.
  struct Part {
    std::uint64_t width = 0, height = 0, tile_width = 0, tile_height = 0, rows = 1;

    [[nodiscard]] std::uint64_t chunks() const {
      if (tile_width == 0 || tile_height == 0) return (height + rows - 1) / rows;
      return ((width + tile_width - 1) / tile_width) * ((height + tile_height - 1) / tile_height);
    }
  };

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > left_.size()) throw HeaderError("is truncated: its header is not within the file");
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

  std::uint32_t number() { return static_cast<std::uint32_t>(little_endian(take(4), 0, 4)); }

  std::string_view text() {
    const auto end = std::ranges::find(left_, 0);
    const auto length = static_cast<std::size_t>(end - left_.begin());
    const std::string_view text{reinterpret_cast<const char*>(left_.data()), length};
    take(length + 1);
    return text;
  }

  /// Reads the zero byte that ends a list of names.
  bool at_end_of_part() {
    if (!left_.empty() && left_.front() != 0) return false;
    take(1);
    return true;
  }

  void attribute() {
    const std::string_view name = text(), type = text();
    const std::uint32_t size = number();
    if (size > left_.size())
      throw HeaderError("is truncated: its header has an attribute of " + std::to_string(size) + " bytes, " +
                        std::to_string(left_.size()) + " are left");
    const auto rest = left_.subspan(size);
    if (name == "dataWindow" && type == "box2i") window();
    if (name == "tiles" && type == "tiledesc") tiles();
    if (name == "compression" && size > 0) part_.rows = chunk_rows[std::min<std::size_t>(left_[0], 9)];
    left_ = rest;
  }

  void window() {
    std::array<std::int64_t, 4> edges{};
    for (std::int64_t& edge : edges) edge = static_cast<std::int32_t>(number());
    const auto [left, top, right, bottom] = edges;
    if (right < left || bottom < top) throw HeaderError("has no pixels");
    part_.width = static_cast<std::uint64_t>(right - left + 1);
    part_.height = static_cast<std::uint64_t>(bottom - top + 1);
    if (part_.width * part_.height > limits_.pixels)
      throw HeaderError("the limit pixels is " + std::to_string(limits_.pixels) + ", it has " +
                        std::to_string(part_.width) + " x " + std::to_string(part_.height));
  }

  void tiles() {
    part_.tile_width = number();
    part_.tile_height = number();
    if (part_.tile_width * part_.tile_height > limits_.pixels)  // product of two 32-bit numbers: no overflow
      throw HeaderError("the limit pixels is " + std::to_string(limits_.pixels) + ", it has tiles of " +
                        std::to_string(part_.tile_width) + " x " + std::to_string(part_.tile_height));
  }

  std::span<const std::uint8_t> left_;
  const TextureImageLimits& limits_;
  Part part_;
};

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

/// The result of `read`; failures of the library as sentences.
template <class Value, class Read>
Result<Value, std::string> call_library(const Read& read) try {
  const auto library = open_image_io();
  if (!library) return library.error();
  return read(**library);
} catch (const HeaderError& error) {
  return std::string(error.what());
} catch (const std::bad_alloc&) {
  return std::string("takes more memory than there is");
} catch (const std::exception& failure) {
  return std::string("cannot be read: ") + failure.what();
}

}  // namespace

std::optional<ImageFormat> image_kind(std::span<const std::uint8_t> bytes) {
  const auto begins_with = [text = text_of(bytes)](std::string_view magic) {
    return magic.size() <= text.size() &&
           std::equal(magic.begin(), magic.end(), text.begin(), [](char a, char b) { return a == '.' || a == b; });
  };
  for (std::size_t kind = 0; kind < std::size(image_format_rows); ++kind) {
    const ImageFormatRow& row = image_format_rows[kind];
    if (begins_with(row.magic) || begins_with(row.other_magic)) return static_cast<ImageFormat>(kind);
  }
  return std::nullopt;
}

Decoded decode_as(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace color_space,
                  const TextureImageLimits& limits, ImageTexture::Channel channel) {
  if (kind == ImageFormat::jpeg && !ends_as_jpeg(bytes))
    return std::string("is truncated: it does not end as a JPEG does");
  if (kind == ImageFormat::png && !has_png_trailer(bytes))
    return std::string("is truncated: its last chunk is not within the file");
  if (kind == ImageFormat::webp && webp_pixels(bytes) > limits.pixels)
    return "the limit pixels is " + std::to_string(limits.pixels) + ", it has " + std::to_string(webp_pixels(bytes));
  return call_library<Image>([&](const OpenImageIo& library) {
    if (kind == ImageFormat::openexr) ExrHeader(bytes, limits).check();
    return library.read(kind, bytes, color_space, limits, channel);
  });
}

Result<ChannelValues, std::string> decode_channels(std::span<const std::uint8_t> bytes,
                                                   const std::vector<std::string>& names,
                                                   const TextureImageLimits& limits) {
  if (image_kind(bytes) != ImageFormat::openexr) return std::string("is no OpenEXR file");
  return call_library<ChannelValues>([&](const OpenImageIo& library) {
    ExrHeader(bytes, limits).check();
    return library.read_channels(bytes, names, limits);
  });
}

Decoded decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
               const TextureImageLimits& limits, ImageTexture::Channel channel) {
  if (bytes.empty()) return std::string("is empty");
  const std::optional<ImageFormat> kind = image_kind(bytes);
  constexpr ImageFormat known[] = {ImageFormat::png, ImageFormat::jpeg, ImageFormat::openexr, ImageFormat::hdr};
  if (!kind || std::ranges::find(known, *kind) == std::end(known))
    return std::string("is no PNG, JPEG, OpenEXR or Radiance HDR file: its first bytes are none of theirs");
  return decode_as(*kind, bytes, color_space.value_or(is_linear(*kind) ? ColorSpace::linear : ColorSpace::srgb), limits,
                   channel);
}

}  // namespace tracer
