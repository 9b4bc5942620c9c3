#pragma once
/// What a client's Accept, Range and If-None-Match headers ask for: pure functions over header values.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace http {

/// The offer that `accept` likes best (RFC 9110, section 12.5.1: the most specific range decides each offer's weight);
/// of equal ones the first. An absent or empty header accepts everything; weight 0 refuses. Nothing when every offer is
/// refused. Unreadable members are passed over.
std::optional<std::size_t> best_offer(std::optional<std::string_view> accept,
                                      const std::vector<std::string_view>& offers);

/// Half-open window of bytes.
struct ByteRange {
  std::uint64_t begin = 0, end = 0;
  bool operator==(const ByteRange&) const = default;
};

struct RangeAnswer {
  enum class Kind { whole, part, unsatisfiable };
  Kind kind = Kind::whole;
  ByteRange range{};  ///< of a part; never empty
};

/// One range of bytes out of `size_bytes` (RFC 9110, section 14.2). Several ranges, other units and what cannot be read
/// are answered with the whole: that is always correct, and no request can multiply its answer.
RangeAnswer read_range(std::optional<std::string_view> range, std::uint64_t size_bytes);

/// How long the client likes to wait (RFC 7240, section 4.3): the first preference "wait", whole seconds. Nothing where
/// there is none, or none that can be read: preferences are never an error.
std::optional<std::chrono::seconds> preferred_wait(std::string_view prefer);

/// Does If-None-Match name `etag` (as it is sent, with its quotes), by weak comparison, or everything?
bool none_match_names(std::string_view if_none_match, std::string_view etag);

/// Is this Content-Type application/json, with any parameters but another charset than UTF-8?
bool is_json(std::string_view content_type);

}  // namespace http
