#pragma once
/// Parts of the messages of issues: values, and the name that a mistyped one probably stands for.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "api/reader/json_parser.h"

namespace api {

std::string quoted(std::string_view text);     ///< in double quotes, at most 64 bytes of it, valid UTF-8
std::string describe(const json::Node& node);  ///< "the string \"red\"", "the number 3", "an array of 3", ...
std::string number_text(double value);         ///< shortest that reads back the same
std::string list_of(std::span<const std::string_view> words);  ///< each quoted, separated by commas

inline constexpr std::size_t suggestion_names_max = 1000;

/// "; did you mean \"glass\"?" for the nearest of `names` by edit distance, if at most a third of the letters differ;
/// else empty. Only the first `suggestion_names_max` names and words of up to 64 bytes are compared, which bounds the
/// time for a document with many issues.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> names);

/// "; write \"reflection\": ..." for a name from another program (src/reader/foreign_words.txt) in the scope `kind`, or
/// in the more general `group` if the form begins with one of `names` or belongs in the document; else did_you_mean().
std::string suggestion(std::string_view word, std::string_view kind, std::string_view group,
                       std::span<const std::string_view> names);

}  // namespace api
