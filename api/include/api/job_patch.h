#pragma once
/// Reads the body of PATCH /v1/jobs/{id}, a JSON merge patch (RFC 7396).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// {priority, name, labels{NAME: VALUE|null}, expires_at|null}, each optional. Unset: unchanged.
struct RequestedChange {
  std::optional<int> priority;  ///< 0..100
  std::optional<std::string> name;
  std::map<std::string, std::optional<std::string>> labels;  ///< null: removed; labels that are not named are kept
  std::optional<std::optional<std::int64_t>> expires_at;     ///< ms since 1970 UTC; null: never
};

/// As parse_scene: all issues at once, never throws.
tracer::Result<RequestedChange, Refusal> parse_change(std::string_view bytes, const Limits& limits);

}  // namespace api
