#pragma once
/// Channels of an EXR: the image, then its layers.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/image.h"

namespace tracer {

/// `words` has one 32-bit word per channel, interleaved by pixel: a float, or an integer if `is_integer`.
struct ExrChannels {
  std::vector<std::string> names;
  std::vector<bool> is_integer;
  std::vector<std::uint32_t> words;
};

/// R, G, B, A if there is alpha, and the layers of `image`.
ExrChannels exr_channels(const Image& image);

}  // namespace tracer
