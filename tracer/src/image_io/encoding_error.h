#pragma once
/// Error of an encoded image file: the difference between what the file and the image display.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tracer/encode.h"
#include "tracer/image.h"
#include "tracer/src/display/display_transform.h"

namespace tracer {

/// A row of display values in levels, one plane per channel.
using LevelRow = std::array<std::vector<float>, 3>;
/// Writes what a file displays in row y. Called by several threads.
using WriteLevelRow = std::function<void(std::size_t y, LevelRow& levels)>;

/// Codes as levels. `codes` has 8 or 16 bits for each of three channels per pixel, or four with straight alpha, which
/// is composited over black in linear light. The span must outlive it.
WriteLevelRow levels_of(std::span<const std::uint8_t> codes, int channels, std::uint32_t width);
WriteLevelRow levels_of(std::span<const std::uint16_t> codes, int channels, std::uint32_t width);

/// `file` against the display values of `image`; accurate to 2e-4 levels. Runs on the calling thread's oneTBB arena;
/// the result does not depend on the number of threads.
EncodingError encoding_error(const Image& image, const DisplayTransform& display, const WriteLevelRow& file);

}  // namespace tracer
