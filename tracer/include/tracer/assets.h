#pragma once
/// Bytes of the files that a scene names. The caller reads them: the tracer opens no file.

#include <cstdint>
#include <vector>

namespace tracer {

/// `bytes[id.index]` is the content of `scene.assets[id.index]`; entries missing at the end are empty files.
struct Assets {
  std::vector<std::vector<std::uint8_t>> bytes;
};

}  // namespace tracer
