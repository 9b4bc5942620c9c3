#pragma once
/// Turns an image into the bytes of a file, in memory.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/image.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// For display, after exposure, overflow and palette: sRGB (IEC 61966-2-1), clamped to [0,1], rounded to nearest.
///   png: 8 bits, no dithering, `sRGB` chunk. png16: 16 bits, no palette. tiff: as png16, not compressed. jpg: 8
///   bits, quality 95, no palette, no alpha: over black. webp: as jpg, with colours at half the resolution.
/// The radiance as it is, linear, unclamped:
///   exr: 32-bit float, ZIP compressed; layers are channels Z, normal.X .Y .Z, albedo.R .G .B, object_id and samples
///   (both 32-bit integers). hdr: 8-bit mantissas with a common exponent, no alpha: over black.
/// Alpha is straight, but for EXR, where the colour is premultiplied by it.
/// Equal images give equal bytes: no time stamp, no machine name, whatever the number of threads, which are those of
/// the calling thread's oneTBB arena. Fails with a sentence when the encoder does.
Result<std::vector<std::uint8_t>, std::string> encode(const Image& image, Format format, const Output& output = {});

/// Every format, the usual ones first.
inline constexpr Format all_formats[] = {Format::png,   Format::exr,  Format::jpg, Format::hdr,
                                         Format::png16, Format::webp, Format::tiff};

/// How documents call it: "png16".
std::string_view name(Format format);
/// "png" and "image/png", "exr" and "image/x-exr". The extension has no dot in front; "16.png" is that of png16.
std::string_view extension(Format format);
std::string_view media_type(Format format);

}  // namespace tracer
