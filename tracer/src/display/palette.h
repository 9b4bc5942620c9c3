#pragma once
/// Color quantization.

#include <cstdint>
#include <span>

namespace tracer {

/// Reduces `codes` (sRGB, 8 bits, three per pixel) to at most `colors` different colors by median cut (Heckbert 1982,
/// "Color image quantization for frame buffer display"): the divisible box with the most pixels is cut across its
/// longest side at the median, until there are enough boxes. Each color becomes the mean of its box over the pixels, in
/// linear light. An image with no more than `colors` colors is unchanged. Deterministic.
void reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors);

}  // namespace tracer
