#pragma once
/// The bytes of a picture file to a picture: PNG, JPEG, OpenEXR, Radiance HDR, and nothing else.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

enum class ImageFile { png, jpeg, openexr, hdr };

/// By the file's first bytes alone; nothing when they are no such file's.
std::optional<ImageFile> image_file(std::span<const std::uint8_t> bytes);

/// Linear RGB. Grey becomes three equal channels; alpha, and what comes behind it, is left out, colours are not
/// multiplied by it. Only the first picture of a file is read. `color_space` unset: sRGB for PNG and JPEG, linear for
/// the others. Negative values, which OpenEXR may hold, become 0.
/// Fails with a sentence: no such file, not within `limits` (by its header, before anything else is read), truncated or
/// broken, values that are not finite. Rows are held as they come, so a header that promises what does not follow takes
/// no memory.
Result<Image, std::string> decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
                                  const TextureImageLimits& limits);

}  // namespace tracer
