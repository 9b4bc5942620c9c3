#pragma once
/// PNG files with libpng and zlib. Most images are PNG, and loading OpenImageIO takes longer than rendering a small
/// one.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// `codes`: sRGB of `bits` 8 (bytes) or 16 (native words), `channels` 3, or 4 with straight alpha; rows from the top.
/// With a `palette` of sRGB colors `channels` is 1, and the codes are bytes that index it.
/// Writes an `sRGB` chunk. Compressed on the calling thread's oneTBB arena, to the same bytes for any number of
/// threads. Fails with libpng's message.
Result<std::vector<std::uint8_t>, std::string> png_file(std::uint32_t width, std::uint32_t height, int channels,
                                                        int bits, const void* codes,
                                                        std::span<const std::array<std::uint8_t, 3>> palette = {});

}  // namespace tracer
