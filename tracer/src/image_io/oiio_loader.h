#pragma once
/// Interface to OpenImageIO. Its 258 libraries take 0.17 s and 120 MiB to load, so it is in a plugin (oiio_plugin.cpp)
/// that is loaded on first use. PNG and TIFF do not need it.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

using Encoded = Result<std::vector<std::uint8_t>, std::string>;
using Decoded = Result<Image, std::string>;

/// Values of some channels of a file, interleaved by pixel, row 0 on top.
struct ChannelValues {
  std::uint32_t width = 0, height = 0;
  std::vector<float> values;
};

struct OpenImageIo {
  /// Writes three channels per pixel, sRGB codes or linear radiance, and decodes the file again into `values`.
  /// `quality`, 1 .. 100, matters to lossy formats only.
  Encoded (*write_codes)(ImageFormat kind, const Image& size, std::span<std::uint8_t> values, std::uint32_t quality);
  Encoded (*write_floats)(ImageFormat kind, const Image& size, std::span<float> values, std::uint32_t quality);
  /// `half`: colors and alpha, whose values must be 16-bit floats, are written as such.
  Encoded (*exr)(const Image& image, bool half);
  /// Like decode_as (decode.h), without its checks of the file. May throw.
  Decoded (*read)(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace space,
                  const TextureImageLimits& limits, ImageTexture::Channel channel);
  /// Like decode_channels (decode.h), without its checks of the file. May throw.
  Result<ChannelValues, std::string> (*read_channels)(std::span<const std::uint8_t> bytes,
                                                      const std::vector<std::string>& names,
                                                      const TextureImageLimits& limits);
};

/// Thread-safe. Fails with a sentence if the plugin is not installed or does not load.
Result<const OpenImageIo*, std::string> open_image_io();

/// The plugin's exported symbol: `extern "C" const OpenImageIo whittle_open_image_io`.
inline constexpr const char* open_image_io_symbol = "whittle_open_image_io";

}  // namespace tracer
