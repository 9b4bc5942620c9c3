#pragma once
/// What OpenImageIO is asked. It draws in 258 libraries, which take 0.17 s and 120 MiB to load: it is a module of its
/// own (oiio_module.cpp) that is loaded when it is asked for the first time. PNG and TIFF need none of it.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/display_image.h"
#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

using Encoded = Result<std::vector<std::uint8_t>, std::string>;
using Decoded = Result<Image, std::string>;
using Codes = std::span<const std::uint8_t>;  ///< sRGB, three a pixel

struct OpenImageIo {
  Encoded (*jpeg)(const Image& size, Codes codes);
  Encoded (*webp)(const Image& size, Codes codes);
  Encoded (*exr)(const Image& image);
  Encoded (*hdr)(const Image& image);
  /// As decode_as, without what file_marks.h finds out beforehand. May throw.
  Decoded (*read)(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace space,
                  const TextureImageLimits& limits);
};

/// Thread-safe. Fails with a sentence where the module is not beside the program or does not load.
Result<const OpenImageIo*, std::string> open_image_io();

/// The module's one symbol that is looked up: `extern "C" const OpenImageIo whittle_open_image_io`.
inline constexpr const char* open_image_io_symbol = "whittle_open_image_io";

}  // namespace tracer
