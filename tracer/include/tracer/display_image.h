#pragma once
/// Images as a screen shows them, rendered or from files: what images are compared by. Pure functions; any thread.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// What a screen is told: sRGB codes from 0 to 65535, RGB interleaved, row 0 on top, no padding. Codes of files, of 8
/// bits as of 16, are whole numbers here and so exact; those of a rendered image are not rounded to any.
struct DisplayImage {
  std::uint32_t width = 0, height = 0;
  std::vector<float> codes;
};
inline constexpr double codes_per_level = 257;  // 65535 / 255

/// A rendered image after `output`'s exposure and overflow (its palette is not applied); transparent parts over
/// black. Not-a-number is black.
DisplayImage to_display(const Image& image, const Output& output = {});

enum class ImageFormat { png, jpeg, openexr, hdr, tiff, webp };
/// "PNG", "OpenEXR"
const char* name(ImageFormat kind);
/// Whether files of that kind hold light, not codes.
constexpr bool is_linear(ImageFormat kind) { return kind == ImageFormat::openexr || kind == ImageFormat::hdr; }

struct ImageFile {
  DisplayImage image;
  ImageFormat kind = ImageFormat::png;
};

/// Of files compared: every image that can be rendered, with all its layers, can be compared.
inline constexpr TextureImageLimits compared_file_limits{
    .pixels = Limits{}.pixels, .channels = 16, .bytes = 16 * sizeof(float) * Limits{}.pixels};

/// The bytes of a PNG, JPEG, TIFF or WebP file, whose codes are taken for sRGB; or of an OpenEXR or Radiance HDR file,
/// whose light gets exposure 0, is clamped, and goes through the sRGB curve. Alpha is left out: colours count as the
/// file has them, also where they are transparent; so are layers and all images but a file's first. Fails with a
/// sentence for everything else, for what is truncated or broken, and for what exceeds `limits` (told by the header).
Result<ImageFile, std::string> read_image(std::span<const std::uint8_t> bytes,
                                          const TextureImageLimits& limits = compared_file_limits);

}  // namespace tracer
