#pragma once
/// Baseline TIFF of our own (Adobe 1992, "TIFF Revision 6.0", part 1): OpenImageIO 2.4 writes it to files alone;
/// written to memory its EXIF directory lands on the image's own.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace tracer {

/// An image's 16-bit codes, row 0 on top: three a pixel, or four, then the last is straight alpha.
struct TiffCodes {
  std::uint16_t channels;
  /// Writes so many of them, from the one numbered `first` on. Any thread; no two pieces overlap.
  std::function<void(std::size_t first, std::span<std::uint16_t> into)> write;
};

/// Not compressed, little-endian, one strip. Precondition: the codes take less than 4 GiB. The file's bytes are the
/// only room of the image's size that it takes.
std::vector<std::uint8_t> tiff16(std::uint32_t width, std::uint32_t height, const TiffCodes& codes);

}  // namespace tracer
