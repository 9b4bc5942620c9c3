#pragma once
/// The two forms of glTF files: JSON text, or GLB, a container of JSON and one binary chunk. Base64 of data: URIs.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/result.h"

namespace api::gltf {

using Bytes = std::span<const std::uint8_t>;

/// Views of the file's parts.
struct Container {
  std::string_view json;
  std::size_t json_offset = 0;  ///< position of `json` in the file
  std::optional<Bytes> binary;  ///< GLB's second chunk
};

bool is_glb(Bytes bytes);

/// Fails with a sentence that begins with the position (section 4.4).
tracer::Result<Container, std::string> open_container(Bytes bytes);

/// Decodes base64 (RFC 4648, section 4). Unset for other characters, an impossible length, or padding except at the
/// end. The padding may be missing, and unused bits may have any value.
std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

}  // namespace api::gltf
