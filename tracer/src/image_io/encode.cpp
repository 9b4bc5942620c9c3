#include "tracer/encode.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/display/srgb.h"
#include "tracer/src/display/tone_mapping.h"
#include "tracer/src/image_io/oiio_loader.h"
#include "tracer/src/image_io/png_file.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

/// TIFF 6.0, section 2: types and their sizes.
enum Type : std::uint16_t { type_short = 3, type_long = 4, type_rational = 5 };

class TiffWriter {
 public:
  void put16(std::uint16_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  void put32(std::uint32_t value) {
    put16(static_cast<std::uint16_t>(value & 0xffff));
    put16(static_cast<std::uint16_t>(value >> 16));
  }
  /// Writes a directory entry; `value` is the offset of values that take more than four bytes. A single short is in the
  /// lower half, its position in a little-endian number.
  void entry(std::uint16_t tag, Type type, std::uint32_t count, std::uint32_t value) {
    put16(tag);
    put16(type);
    put32(count);
    put32(value);
  }

  std::vector<std::uint8_t> bytes;
};

/// Baseline TIFF (Adobe 1992, "TIFF Revision 6.0", part 1). OpenImageIO 2.4 corrupts TIFF files that it writes to
/// memory: the EXIF directory overwrites the image directory. Uncompressed, little-endian, one strip. `codes` has 16
/// bits for each of `channels`, row 0 on top: 3, or 4 with straight alpha. Precondition: the codes take less than 4
/// GiB.
std::vector<std::uint8_t> tiff16(std::uint32_t width, std::uint32_t height, std::uint16_t channels,
                                 std::vector<std::uint16_t> codes) {
  const bool alpha = channels == 4;
  const std::uint16_t entries = alpha ? 14 : 13;
  constexpr std::uint32_t header = 8;
  const std::uint32_t bits = header + 2 + 12 * entries + 4;  // after the directory: bits of each channel,
  const std::uint32_t resolution = bits + 2 * channels;      // one pixel per unit,
  const std::uint32_t strip = resolution + 8;                // and the pixels
  const auto strip_bytes = static_cast<std::uint32_t>(2 * codes.size());
  TiffWriter writer;
  writer.bytes.reserve(strip + strip_bytes);
  writer.bytes = {'I', 'I', 42, 0};
  writer.put32(header);  // offset of the directory
  writer.put16(entries);
  writer.entry(256, type_long, 1, width);
  writer.entry(257, type_long, 1, height);
  writer.entry(258, type_short, channels, bits);
  writer.entry(259, type_short, 1, 1);  // not compressed
  writer.entry(262, type_short, 1, 2);  // RGB
  writer.entry(273, type_long, 1, strip);
  writer.entry(277, type_short, 1, channels);
  writer.entry(278, type_long, 1, height);  // rows in the strip
  writer.entry(279, type_long, 1, strip_bytes);
  writer.entry(282, type_rational, 1, resolution);
  writer.entry(283, type_rational, 1, resolution);
  writer.entry(284, type_short, 1, 1);             // channels side by side
  writer.entry(296, type_short, 1, 1);             // no unit of length
  if (alpha) writer.entry(338, type_short, 1, 2);  // straight
  writer.put32(0);                                 // no further image
  for (std::uint16_t channel = 0; channel < channels; ++channel) writer.put16(16);
  writer.put32(1);
  writer.put32(1);
  writer.bytes.resize(strip + std::size_t{strip_bytes});
  if constexpr (std::endian::native == std::endian::big)
    for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(code << 8 | code >> 8);
  std::memcpy(writer.bytes.data() + strip, codes.data(), strip_bytes);
  return std::move(writer.bytes);
}

/// Codes of 8 or 16 bits, three or four per pixel.
template <class Code>
struct DisplayCodes {
  int channels = 3;
  std::vector<Code> codes;
};

template <class Code>
std::vector<Code> codes_of(const std::vector<float>& linear) {
  constexpr std::size_t piece = std::size_t{1} << 17;
  std::vector<Code> codes(linear.size());
  for_each_tile((linear.size() + piece - 1) / piece, 0, [&](std::uint64_t index) {
    const std::size_t first = index * piece, count = std::min(piece, linear.size() - first);
    const auto from = std::span(linear).subspan(first, count);
    const auto into = std::span(codes).subspan(first, count);
    if constexpr (sizeof(Code) == 1) {
      srgb8_from_linear(from, into);
    } else {
      srgb16_from_linear(from, into);
    }
  });
  return codes;
}

/// Alpha is coverage and stays linear.
template <class Code>
void add_alpha(DisplayCodes<Code>& display, const std::vector<float>& alpha) {
  constexpr float most = std::numeric_limits<Code>::max();
  std::vector<Code> codes;
  codes.reserve(4 * alpha.size());
  for (std::size_t pixel = 0; pixel < alpha.size(); ++pixel)
    codes.insert(codes.end(), {display.codes[3 * pixel], display.codes[3 * pixel + 1], display.codes[3 * pixel + 2],
                               static_cast<Code>(std::lround(alpha[pixel] * most))});
  display = {4, std::move(codes)};
}

enum class Alpha { straight, over_black };

template <class Code>
DisplayCodes<Code> to_display(const Image& image, const Output& output, Alpha alpha = Alpha::straight,
                              std::uint32_t colors = 0) {
  DisplayCodes<Code> result;
  const bool with_alpha = alpha == Alpha::straight && !image.alpha.empty();
  if (!with_alpha && output.exposure == 0 && output.overflow == Output::Overflow::clamp) {
    result.codes = codes_of<Code>(image.rgb);
  } else {
    std::vector<float> linear = with_alpha ? straight_color(image) : image.rgb;
    apply_tone(linear, output);
    result.codes = codes_of<Code>(linear);
  }
  if constexpr (sizeof(Code) == 1) {
    if (colors != 0) reduce_colors(result.codes, colors);
  }
  if (with_alpha) add_alpha(result, image.alpha);
  return result;
}

template <class Code>
Encoded encode_png(const Image& image, const DisplayCodes<Code>& display) {
  return png_file(image.width, image.height, display.channels, 8 * static_cast<int>(sizeof(Code)),
                  display.codes.data());
}

}  // namespace

Encoded encode(const Image& image, Format format, const Output& output) {
  // Not every encoder rejects empty images: the JPEG encoder crashes.
  if (image.width == 0 || image.height == 0) return std::string(name(format)) + " encoder: the image has no pixels";
  if (format == Format::png)
    return encode_png(image, to_display<std::uint8_t>(image, output, Alpha::straight, output.palette));
  if (format == Format::png16) return encode_png(image, to_display<std::uint16_t>(image, output));
  if (format == Format::tiff) {
    auto display = to_display<std::uint16_t>(image, output);
    return tiff16(image.width, image.height, static_cast<std::uint16_t>(display.channels), std::move(display.codes));
  }
  const auto library = open_image_io();
  if (!library) return library.error();
  if (format == Format::exr) return (*library)->exr(image);
  if (format == Format::hdr) return (*library)->hdr(image);
  const auto display = to_display<std::uint8_t>(image, output, Alpha::over_black);
  return format == Format::jpg ? (*library)->jpeg(image, display.codes) : (*library)->webp(image, display.codes);
}

}  // namespace tracer
