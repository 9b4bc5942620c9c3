#pragma once
/// The bytes of the files that a scene names, read by whoever calls the tracer.

#include <cstdint>
#include <vector>

namespace tracer {

/// `bytes[id.index]` is the content of `scene.assets[id.index]`; what is missing at the end is empty.
struct Assets {
  std::vector<std::vector<std::uint8_t>> bytes;
};

}  // namespace tracer
