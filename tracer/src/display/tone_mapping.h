#pragma once
/// Tone mapping from radiance to linear display values (exposure, then overflow; the sRGB curve is applied later), and
/// color quantization of the displayed image.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace tracer {

/// Colors divided by their alpha; black where alpha is 0. Three values per pixel, like `image.rgb`.
std::vector<float> straight_color(const Image& image);

/// Three values per pixel. Values stay finite and non-negative if `linear` is; with overflow clamp the encoder clamps
/// values above 1. Without exposure and overflow the values are bit-identical.
void apply_tone(std::vector<float>& linear, const Output& output);

/// Reduces `codes` (sRGB, 8 bits, three per pixel) to at most `colors` different colors by median cut (Heckbert 1982,
/// "Color image quantization for frame buffer display"): the divisible box with the most pixels is cut across its
/// longest side at the median, until there are enough boxes. Each color becomes the mean of its box over the pixels, in
/// linear light. An image with no more than `colors` colors is unchanged. Deterministic.
void reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors);

}  // namespace tracer
