#pragma once
/// PNG by libpng itself: most pictures need nothing else, and OpenImageIO takes longer to load than many to trace.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// `codes`: sRGB of `bits` 8 (bytes) or 16 (words of the machine), `channels` 3, or 4 with straight alpha; rows from
/// the top. Says by its chunks that it is sRGB. Fails with libpng's sentence.
Result<std::vector<std::uint8_t>, std::string> png_file(std::uint32_t width, std::uint32_t height, int channels,
                                                        int bits, const void* codes);

}  // namespace tracer
