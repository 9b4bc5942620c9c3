#pragma once
/// Turns a picture into the bytes of a file, in memory.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/image.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// png: 8 bit, sRGB (IEC 61966-2-1), values clamped to [0,1], rounded to nearest, no dithering, `sRGB` chunk.
/// exr: linear RGB, 32-bit float, unclamped, ZIP compressed.
/// Equal pictures give equal bytes: no time stamp, no machine name. Fails with a sentence when the encoder does.
Result<std::vector<std::uint8_t>, std::string> encode(const Image& image, Format format);

/// "png", "image/png"; "exr", "image/x-exr". The extension has no dot.
std::string_view extension(Format format);
std::string_view media_type(Format format);

}  // namespace tracer
