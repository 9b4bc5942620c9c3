#pragma once
/// Decodes image files of every ImageFormat.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/src/image_io/oiio_loader.h"

namespace tracer {

/// Format by the file's first bytes; nothing for other files.
std::optional<ImageFormat> image_kind(std::span<const std::uint8_t> bytes);

/// Decodes to linear RGB. Gray becomes three equal channels; further channels are ignored, and colors are not
/// multiplied by alpha. `channel` alpha: three channels equal to alpha, whatever the color space; fails if the file has
/// none. Only the first image of a file is read. `color_space` linear: values as stored, codes as fractions of their
/// maximum. Negative values (OpenEXR) become 0. Fails with a sentence: header exceeds `limits` (checked before
/// decoding), truncated or malformed file, values that are not finite, TIFF of floats (their color space is undefined).
/// Memory grows with the decoded rows, so a header with false sizes allocates nothing; a WebP file is decoded as a
/// whole.
Result<Image, std::string> decode_as(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace color_space,
                                     const TextureImageLimits& limits,
                                     ImageTexture::Channel channel = ImageTexture::Channel::color);

/// The values of consecutive channels of an OpenEXR file, as stored; integers as floats. Without values if the file
/// does not have them. Fails as decode_as, but not for values that are not finite.
Result<ChannelValues, std::string> decode_channels(std::span<const std::uint8_t> bytes,
                                                   const std::vector<std::string>& names,
                                                   const TextureImageLimits& limits);

/// Decodes a texture image: PNG, JPEG, OpenEXR or Radiance HDR only. `color_space` unset: sRGB for PNG and JPEG, linear
/// for the others.
Result<Image, std::string> decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
                                  const TextureImageLimits& limits,
                                  ImageTexture::Channel channel = ImageTexture::Channel::color);

}  // namespace tracer
