#pragma once
/// Content negotiation, ranges and preconditions: pure functions over values of request headers.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace http {

/// Index of the offer that `accept` gives the greatest weight (RFC 9110, section 12.5.1: the most specific range
/// decides the weight of an offer); the first of equal ones. An absent or empty header accepts everything; weight 0
/// refuses. Nothing if every offer is refused. Invalid members are ignored.
std::optional<std::size_t> best_offer(std::optional<std::string_view> accept,
                                      const std::vector<std::string_view>& offers);

/// Half-open range of bytes.
struct ByteRange {
  std::uint64_t begin = 0, end = 0;
  bool operator==(const ByteRange&) const = default;
};

struct RangeAnswer {
  enum class Kind { whole, part, unsatisfiable };
  Kind kind = Kind::whole;
  ByteRange range{};  ///< if the kind is part; never empty
};

/// One range of bytes out of `size_bytes` (RFC 9110, section 14.2). Several ranges, other units and invalid ranges give
/// the whole, which is always correct and cannot multiply the size of a reply.
RangeAnswer read_range(std::optional<std::string_view> range, std::uint64_t size_bytes);

/// The first preference "wait" of the header Prefer, in whole seconds (RFC 7240, section 4.3). Nothing if it is absent
/// or invalid: preferences are never an error.
std::optional<std::chrono::seconds> preferred_wait(std::string_view prefer);

/// True if If-None-Match contains `etag` (with its quotes) by weak comparison, or "*".
bool none_match_names(std::string_view if_none_match, std::string_view etag);

/// True if the Content-Type is application/json and its charset, if given, is UTF-8.
bool is_json(std::string_view content_type);

}  // namespace http
