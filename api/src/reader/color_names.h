#pragma once
/// Colors by name (CSS Color Module Level 4, section 6.1).

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace api {

/// 0xRRGGBB, in sRGB.
std::optional<std::uint32_t> color_by_name(std::string_view name);
std::vector<std::string_view> color_names();

}  // namespace api
