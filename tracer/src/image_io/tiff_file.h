#pragma once
/// TIFF files. OpenImageIO 2.4 corrupts those that it writes to memory: the EXIF directory overwrites the image
/// directory.

#include <cstdint>
#include <span>
#include <vector>

namespace tracer {

/// Baseline TIFF (Adobe 1992, "TIFF Revision 6.0", part 1), uncompressed, little-endian, one strip. `codes`: sRGB of 16
/// bits, `channels` 3, or 4 with straight alpha; rows from the top. Precondition: they take less than 4 GiB.
std::vector<std::uint8_t> tiff_file(std::uint32_t width, std::uint32_t height, std::uint16_t channels,
                                    std::span<const std::uint16_t> codes);

}  // namespace tracer
