#pragma once
/// Base64 (RFC 4648, section 4).

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace api::gltf {

/// Nothing where the text is none: another character, a length that no bytes have, padding but at the end. The padding
/// may be missing. Bits that no byte has are not looked at.
std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

}  // namespace api::gltf
