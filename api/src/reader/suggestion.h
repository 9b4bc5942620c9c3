#pragma once
/// "did you mean": the name that a mistyped one probably stands for.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace api {

inline constexpr std::size_t suggestion_names_max = 1000;

/// "; did you mean \"glass\"?" for the nearest of `names` by edit distance, where it is near enough for a slip (a third
/// of the letters); else nothing. Looks at the first `suggestion_names_max` names and at words of up to 64 bytes, so
/// that a document full of mistakes stays cheap.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> names);

}  // namespace api
