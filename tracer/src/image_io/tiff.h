#pragma once
/// Baseline TIFF of our own (Adobe 1992, "TIFF Revision 6.0", part 1): OpenImageIO 2.4 writes it to files alone;
/// written to memory its EXIF directory lands on the picture's own.

#include <cstdint>
#include <span>
#include <vector>

namespace tracer {

/// Not compressed, little-endian, one strip, row 0 on top. Three 16-bit codes a pixel, or four: then the last is
/// straight alpha. Precondition: the codes are `width` x `height` pixels and take less than 4 GiB.
std::vector<std::uint8_t> tiff16(std::uint32_t width, std::uint32_t height, std::span<const std::uint16_t> codes);

}  // namespace tracer
