#pragma once
/// The bytes of an image file to an image: PNG, JPEG, OpenEXR, Radiance HDR, and for comparing TIFF and WebP.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "tracer/display_image.h"
#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Linear RGB. Grey becomes three equal channels; alpha, and what comes behind it, is left out, colours are not
/// multiplied by it. Only the first image of a file is read. `color_space` linear: values as the file has them, codes
/// as fractions of their greatest. Negative values, which OpenEXR may hold, become 0.
/// Fails with a sentence: not within `limits` (by its header, before anything else is read), truncated or broken,
/// values that are not finite, a TIFF of floats (which does not say what light they are). Rows are held as they come,
/// so a header that promises what does not follow takes no memory; a WebP file is decoded as a whole.
Result<Image, std::string> decode_as(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace color_space,
                                     const TextureImageLimits& limits);

/// The image of a texture: PNG, JPEG, OpenEXR or Radiance HDR, and nothing else. `color_space` unset: sRGB for PNG
/// and JPEG, linear for the others.
Result<Image, std::string> decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
                                  const TextureImageLimits& limits);

}  // namespace tracer
