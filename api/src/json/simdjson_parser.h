#pragma once
/// The parser of documents in which nothing is wrong, as most are: simdjson.

#include <optional>

#include "api/src/json/tape.h"

namespace api::json {

/// simdjson notes four bytes for each bracket, comma, number and string before it reads any: of a document made of
/// nothing else, five times its size with the copy that it reads from. Larger ones cost time instead.
inline constexpr std::size_t simdjson_bytes_max = std::size_t{4} << 20;

/// The tape that parse_with_nlohmann writes, or nothing: where the document is no JSON, over a limit, has a number that
/// no double holds or a byte order mark, is larger than that, or there is no memory for it.
std::optional<Tape> parse_with_simdjson(std::string_view bytes, const DocumentLimits& limits);

}  // namespace api::json
