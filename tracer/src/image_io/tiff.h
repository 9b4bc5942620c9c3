#pragma once
/// Writer of baseline TIFF (Adobe 1992, "TIFF Revision 6.0", part 1). OpenImageIO 2.4 corrupts TIFF files that it
/// writes to memory: the EXIF directory overwrites the image directory.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace tracer {

/// 16-bit codes of an image, row 0 on top: three per pixel, or four with straight alpha.
struct TiffCodes {
  std::uint16_t channels;
  /// Writes `count` codes from index `first`. Any thread, for disjoint ranges.
  std::function<void(std::size_t first, std::span<std::uint16_t> into)> write;
};

/// Uncompressed, little-endian, one strip. Allocates only the bytes of the file. Precondition: the codes take less than
/// 4 GiB.
std::vector<std::uint8_t> tiff16(std::uint32_t width, std::uint32_t height, const TiffCodes& codes);

}  // namespace tracer
