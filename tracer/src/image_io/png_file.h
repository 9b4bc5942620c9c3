#pragma once
/// PNG files with libpng and zlib. Most images are PNG, and loading OpenImageIO takes longer than rendering a small
/// one.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// `codes`: sRGB of `bits` 8 (bytes) or 16 (native words), `channels` 3, or 4 with straight alpha; rows from the top.
/// Writes an `sRGB` chunk. Compressed on the calling thread's oneTBB arena, to the same bytes for any number of
/// threads. Fails with libpng's message.
Result<std::vector<std::uint8_t>, std::string> png_file(std::uint32_t width, std::uint32_t height, int channels,
                                                        int bits, const void* codes);

}  // namespace tracer
