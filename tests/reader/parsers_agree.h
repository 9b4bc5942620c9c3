#pragma once
/// Whether the quick parser of JSON says what the thorough one says.

#include <bit>
#include <cmath>
#include <string>
#include <string_view>

#include "api/src/json/nlohmann_parser.h"
#include "api/src/json/simdjson_parser.h"

namespace reader_tests {

inline bool same(const api::json::Node& a, const api::json::Node& b) {
  using api::json::Kind;
  if (a.kind != b.kind) return false;
  switch (a.kind) {
    case Kind::null:
      return true;
    case Kind::boolean:
      return a.truth == b.truth;
    case Kind::number:
      return std::bit_cast<std::uint64_t>(a.number) == std::bit_cast<std::uint64_t>(b.number);
    case Kind::string:
      return a.string() == b.string();
    case Kind::array:
    case Kind::object:
      return a.size == b.size && a.end == b.end;
  }
  return false;
}

/// What they differ in; empty where they agree. The quick one may leave a document to the other one, but none of
/// objects or arrays that is right, not too large, without a byte order mark and of numbers that are doubles.
inline std::string disagreement(std::string_view bytes, const api::DocumentLimits& limits) {
  using api::json::Kind;
  auto quick = api::json::parse_with_simdjson(bytes, limits);
  auto thorough = api::json::parse_with_nlohmann(bytes, limits);
  if (!thorough) return quick ? "the quick one takes what the thorough one refuses: " + thorough.error().detail : "";
  const auto& expected = thorough->nodes;
  if (!quick) {
    if (expected[0].kind != Kind::array && expected[0].kind != Kind::object) return "";
    if (bytes.starts_with("\xEF\xBB\xBF") || limits.depth > 64) return "";
    if (bytes.size() > api::json::simdjson_bytes_max) return "";
    for (const api::json::Node& node : expected)
      if (node.kind == Kind::number && std::isinf(node.number)) return "";
    return "the quick one refuses what is right";
  }
  if (quick->nodes.size() != expected.size()) return "one has more values";
  for (std::size_t i = 0; i < expected.size(); ++i)
    if (!same(quick->nodes[i], expected[i])) return "value " + std::to_string(i) + " is another";
  return "";
}

}  // namespace reader_tests
