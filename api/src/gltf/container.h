#pragma once
/// The two kinds of glTF file: JSON text, or GLB, a container of JSON and one binary chunk.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tracer/result.h"

namespace api::gltf {

using Bytes = std::span<const std::uint8_t>;

/// Parts of the file's bytes.
struct Container {
  std::string_view json;
  std::size_t json_offset = 0;  ///< in the file
  std::optional<Bytes> binary;  ///< GLB's second chunk
};

bool is_glb(Bytes bytes);

/// Fails with a sentence that begins with the byte (section 4.4).
tracer::Result<Container, std::string> open_container(Bytes bytes);

}  // namespace api::gltf
