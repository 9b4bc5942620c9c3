#pragma once
/// Writer of baseline TIFF (Adobe 1992, "TIFF Revision 6.0", part 1). OpenImageIO 2.4 corrupts TIFF files that it
/// writes to memory: the EXIF directory overwrites the image directory.

#include <cstdint>
#include <vector>

namespace tracer {

/// Uncompressed, little-endian, one strip. `codes` has 16 bits for each of `channels`, row 0 on top: 3, or 4 with
/// straight alpha. Precondition: the codes take less than 4 GiB.
std::vector<std::uint8_t> tiff16(std::uint32_t width, std::uint32_t height, std::uint16_t channels,
                                 std::vector<std::uint16_t> codes);

}  // namespace tracer
