#pragma once
/// Requests about uploaded files, and their replies.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// Maximum of one request. A scene of a thousand files is large; ten thousand lookups take some tens of ms.
inline constexpr std::size_t asset_hashes_max = 10'000;

/// Reads {"sha256": ["64 lower-case hex digits", ...]}; any bytes, as parse_scene. The hashes are returned in their
/// order, without duplicates.
tracer::Result<std::vector<std::string>, Refusal> parse_asset_hashes(std::string_view bytes,
                                                                     const DocumentLimits& limits);

/// {missing: [...]}
std::string write_missing(const std::vector<std::string>& hashes);

/// {sha256, bytes}
std::string write_asset(const std::string& sha256, std::uint64_t bytes);

bool is_asset_hash(std::string_view text);  ///< 64 lower-case hex digits

}  // namespace api
