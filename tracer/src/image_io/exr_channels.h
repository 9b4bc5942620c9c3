#pragma once
/// The channels of an EXR: the image, then what else was kept of it.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/image.h"

namespace tracer {

/// `words` has one of 32 bits a channel, pixel by pixel: a float, or an integer where `is_integer`.
struct ExrChannels {
  std::vector<std::string> names;
  std::vector<bool> is_integer;
  std::vector<std::uint32_t> words;
};

/// R, G, B, A where there is alpha, and the layers that `image` has.
ExrChannels exr_channels(const Image& image);

}  // namespace tracer
