#pragma once
/// Tone mapping from radiance to linear display values (exposure, then overflow; the sRGB curve is applied later), and
/// color quantization of the displayed image.

#include <array>
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

/// Colors of a reduced image and the index of each pixel's.
struct Palette {
  std::vector<std::array<std::uint8_t, 3>> colors;  ///< sRGB
  std::vector<std::uint8_t> indices;
};

/// Reduces `codes` (sRGB, 8 bits, three per pixel) to at most `colors` <= 256 different colors. Boxes of colors are cut
/// in two, across the axis and at the code where the cut lowers the sum of squared errors of all codes most, until
/// there are enough (Wu 1991, "Efficient statistical computations for optimal color quantization", Graphics Gems II).
/// Each color becomes the mean of its box over the pixels. An image with no more than `colors` colors is unchanged.
/// Deterministic.
Palette reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors);

}  // namespace tracer
