#pragma once
/// Pure functions over values of request headers: white space, lists and numbers (RFC 9110, section 5.6), content
/// negotiation, ranges and preconditions.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/support/text_values.h"

namespace http {

using support::lowered;
using support::parse_number;
using support::trimmed;

/// Removes the text up to and including the first `separator` from `text` and returns it, trimmed, without the
/// separator.
inline std::string_view take_until(std::string_view& text, char separator) {
  const std::string_view part = text.substr(0, text.find(separator));
  text.remove_prefix(std::min(text.size(), part.size() + 1));
  return trimmed(part);
}

/// Index of the offer that `accept` gives the greatest weight (RFC 9110, section 12.5.1: the most specific range
/// decides the weight of an offer); the first of equal ones. An absent or empty header accepts everything; weight 0
/// refuses. Nothing if every offer is refused. Invalid members are ignored.
std::optional<std::size_t> best_offer(std::optional<std::string_view> accept,
                                      const std::vector<std::string_view>& offers);

/// True if Accept-Encoding names gzip or * with a weight above 0 (RFC 9110, section 12.5.3).
bool accepts_gzip(std::optional<std::string_view> accept_encoding);

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
bool none_match_names(std::optional<std::string_view> if_none_match, std::string_view etag);

/// True if the Content-Type is `media_type` and its charset, if given, is UTF-8.
bool is_json(std::string_view content_type, std::string_view media_type = "application/json");

}  // namespace http
