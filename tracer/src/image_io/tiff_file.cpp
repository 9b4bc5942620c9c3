#include "tracer/src/image_io/tiff_file.h"

#include <bit>
#include <cstring>
#include <utility>

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

}  // namespace

std::vector<std::uint8_t> tiff_file(std::uint32_t width, std::uint32_t height, std::uint16_t channels,
                                    std::span<const std::uint16_t> codes) {
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
  const std::size_t first = writer.bytes.size();
  writer.bytes.resize(first + std::size_t{strip_bytes});
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(writer.bytes.data() + first, codes.data(), strip_bytes);
  } else {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      writer.bytes[first + 2 * i] = static_cast<std::uint8_t>(codes[i] & 0xff);
      writer.bytes[first + 2 * i + 1] = static_cast<std::uint8_t>(codes[i] >> 8);
    }
  }
  return std::move(writer.bytes);
}

}  // namespace tracer
