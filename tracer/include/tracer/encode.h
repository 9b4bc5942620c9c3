#pragma once
/// Encodes an image as the bytes of a file, in memory, and measures what the file loses.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/image.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Difference between the displayed values of a decoded file and of its image: root mean square over pixels and
/// channels, in levels, before rounding, transparent parts over black.
struct EncodingError {
  double image = 0;       ///< over all pixels
  double worst_tile = 0;  ///< over the tile of 16 x 16 pixels (see ErrorEstimate) with the largest difference
};

struct EncodedImage {
  std::vector<std::uint8_t> bytes;  ///< the file
  EncodingError error;
};

/// Formats for display, after exposure, overflow and palette: sRGB (IEC 61966-2-1), clamped to [0,1], rounded to
/// nearest.
///   png: 8 bits, no dithering, `sRGB` chunk; indexed with a palette, unless there is alpha. png16: 16 bits, no
///   palette. tiff: as png16, not compressed. jpg: 8 bits, no palette, composited over black. webp: as jpg, with chroma
///   at half the resolution.
/// Formats of linear, unclamped radiance:
///   exr: 32-bit float, with `half` 16-bit up to 65504, ZIP compressed; layers are channels Z, normal.X .Y .Z,
///   albedo.R .G .B, object_id and samples (both 32-bit integers). hdr: 8-bit mantissas with a common exponent,
///   composited over black.
/// Alpha is straight, except in EXR, whose colors are premultiplied.
/// Equal images give equal bytes for any number of threads: no time stamp, no machine name. Runs on the calling
/// thread's oneTBB arena. Fails with a sentence if the encoder does.
///
/// The error is computed from the codes that are written; for jpg, webp and hdr by decoding the file. That of exr is 0
/// without `half`: its floats are those of the image. Formats of linear radiance are displayed with the exposure and
/// overflow of `output`.
Result<EncodedImage, std::string> encode(const Image& image, Format format, const Output& output = {});

/// Error of a file against the converged image, in levels.
struct FileError {
  double estimate = 0;     ///< see ErrorEstimate::estimate
  double proven = 0;       ///< see ErrorEstimate::proven; infinity: nothing is proven
  double worst_tile = 0;   ///< see ErrorEstimate::worst_tile
  double encoding = 0;     ///< part caused by the file: EncodingError::image
  bool target_met = true;  ///< see ErrorEstimate::target_met
};

/// Combines the error e = n + f of the image, noise and fixed parts, with the difference d between file and image.
///
/// |e + d|^2 = |e|^2 + |d|^2 + 2 <n, d> + 2 <f, d>. Fixed parts (all but `sampling`) may point in the direction of the
/// rounding, so <f, d> is bounded by |f| |d|. Noise does not: rounding errors are uncorrelated with a signal that is
/// spread over the steps (Bennett 1948, "Spectra of quantized signals"; Widrow 1956, "A study of rough amplitude
/// quantization"), and lossy coders remove noise, so that <n, d> is negative. Hence
///   estimate^2 = image^2 + encoding^2 + 2 sqrt(image^2 - sampling^2) encoding.
/// A plain area whose every value is halfway between two codes has correlated noise; `proven` and `worst_tile` hold for
/// it too, since they are sums (triangle inequality).
FileError file_error(const ErrorEstimate& image, const EncodingError& encoding);

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

/// The most pixels on a side of a file: 65,500 for jpg (JPEG_MAX_DIMENSION of libjpeg), 16,383 for webp, whose frames
/// have 14 bits for a side (RFC 6386, section 9.1). The others hold all images.
constexpr std::uint32_t side_max(Format format) {
  return format == Format::jpg ? 65'500 : format == Format::webp ? 16'383 : std::numeric_limits<std::uint32_t>::max();
}

}  // namespace tracer
