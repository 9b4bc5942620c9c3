#pragma once
/// PNG by libpng and zlib themselves: most images need nothing else, and OpenImageIO takes longer to load than many
/// to trace.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// `codes`: sRGB of `bits` 8 (bytes) or 16 (words of the machine), `channels` 3, or 4 with straight alpha; rows from
/// the top. Says by its chunks that it is sRGB. Packed by all
/// threads of the calling thread's oneTBB arena, to the same bytes for any number of them. Fails with libpng's
/// sentence.
Result<std::vector<std::uint8_t>, std::string> png_file(std::uint32_t width, std::uint32_t height, int channels,
                                                        int bits, const void* codes);

}  // namespace tracer
