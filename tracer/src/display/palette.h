#pragma once
/// An image in few colours.

#include <cstdint>
#include <span>

namespace tracer {

/// Replaces `codes` (sRGB, 8 bits, three a pixel) by at most `colors` different ones, by median cut (Heckbert 1982,
/// "Color image quantization for frame buffer display"): the box of colours with the most pixels among those that can
/// be cut is cut across its longest side where half of its pixels lie on either side, until there are enough. A colour
/// becomes the mean of its box over the pixels, in linear light. An image of no more colours stays as it is. Equal
/// images give equal ones.
void reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors);

}  // namespace tracer
