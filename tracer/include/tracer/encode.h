#pragma once
/// Encodes an image as the bytes of a file, in memory.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/image.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Formats for display, after exposure, overflow and palette: sRGB (IEC 61966-2-1), clamped to [0,1], rounded to
/// nearest.
///   png: 8 bits, no dithering, `sRGB` chunk. png16: 16 bits, no palette. tiff: as png16, not compressed.
///   jpg: 8 bits, quality 95, no palette, composited over black. webp: as jpg, with chroma at half the resolution.
/// Formats of linear, unclamped radiance:
///   exr: 32-bit float, ZIP compressed; layers are channels Z, normal.X .Y .Z, albedo.R .G .B, object_id and samples
///   (both 32-bit integers). hdr: 8-bit mantissas with a common exponent, composited over black.
/// Alpha is straight, except in EXR, whose colors are premultiplied.
/// Equal images give equal bytes for any number of threads: no time stamp, no machine name. Runs on the calling
/// thread's oneTBB arena. Fails with a sentence if the encoder does.
Result<std::vector<std::uint8_t>, std::string> encode(const Image& image, Format format, const Output& output = {});

/// Every format, most common first.
inline constexpr Format all_formats[] = {Format::png,   Format::exr,  Format::jpg, Format::hdr,
                                         Format::png16, Format::webp, Format::tiff};

/// Names of a format.
struct FormatNames {
  std::string_view name;       ///< in documents: "png16"
  std::string_view extension;  ///< without a dot in front: "png", "16.png"
  std::string_view media_type;
};

/// In the order of Format.
inline constexpr FormatNames format_names[] = {{"png", "png", "image/png"},          {"png16", "16.png", "image/png"},
                                               {"exr", "exr", "image/x-exr"},        {"jpg", "jpg", "image/jpeg"},
                                               {"hdr", "hdr", "image/vnd.radiance"}, {"webp", "webp", "image/webp"},
                                               {"tiff", "tiff", "image/tiff"}};

constexpr std::string_view name(Format format) { return format_names[static_cast<std::size_t>(format)].name; }
constexpr std::string_view extension(Format format) { return format_names[static_cast<std::size_t>(format)].extension; }
constexpr std::string_view media_type(Format format) {
  return format_names[static_cast<std::size_t>(format)].media_type;
}

}  // namespace tracer
