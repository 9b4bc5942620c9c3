#pragma once
/// "did you mean": the name that a mistyped one probably stands for.

#include <span>
#include <string>
#include <string_view>

namespace api {

/// "; did you mean \"glass\"?" for the nearest of `names` by edit distance, where it is near enough for a slip (a third
/// of the letters); else nothing. Looks at the first 1000 names and at words of up to 64 bytes, so that a document full
/// of mistakes stays cheap.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> names);

}  // namespace api
