#pragma once
/// Images after display transform, rendered or read from files: the input of compare(). Pure functions, any thread.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// sRGB codes from 0 to 65535, RGB interleaved, row 0 on top, no padding. Codes of 8-bit and 16-bit files are whole
/// numbers here and therefore exact; those of a rendered image are not rounded.
struct DisplayImage {
  std::uint32_t width = 0, height = 0;
  std::vector<float> codes;
};
inline constexpr double codes_per_level = 257;  // 65535 / 255

/// Applies `output`'s exposure and overflow (not its palette) and composites transparent parts over black. NaN is
/// black.
DisplayImage to_display(const Image& image, const Output& output = {});

enum class ImageFormat { png, jpeg, openexr, hdr, tiff, webp };
/// Name for people: "PNG", "OpenEXR".
const char* name(ImageFormat kind);
/// True if files of this format store linear radiance instead of sRGB codes.
constexpr bool is_linear(ImageFormat kind) { return kind == ImageFormat::openexr || kind == ImageFormat::hdr; }

struct ImageFile {
  DisplayImage image;
  ImageFormat kind = ImageFormat::png;
};

/// Limits of files to compare. They admit every image that can be rendered, with all its layers.
inline constexpr TextureImageLimits compared_file_limits{
    .pixels = Limits{}.pixels, .channels = 16, .bytes = 16 * sizeof(float) * Limits{}.pixels};

/// Decodes a PNG, JPEG, TIFF or WebP file (codes are taken as sRGB) or an OpenEXR or Radiance HDR file (exposure 0,
/// clamped, sRGB curve applied). Ignores alpha, layers and all images of a file but the first. Fails with a sentence
/// for other formats, truncated or malformed files, and files whose header exceeds `limits`.
Result<ImageFile, std::string> read_image(std::span<const std::uint8_t> bytes,
                                          const TextureImageLimits& limits = compared_file_limits);

}  // namespace tracer
