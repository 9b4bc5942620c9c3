#pragma once
/// Reads and checks the head of an HTTP/1.x request: a pure function over bytes that come from anyone. What it lets
/// through is unambiguous, so nobody behind it can frame or route the request otherwise (request smuggling).
///
/// Refused are: anything but CRLF line ends, control characters, obs-fold, white space before a colon, other targets
/// than absolute paths, %00-%1F, %7F and %2F escapes, a missing or doubled Host, several or non-decimal
/// Content-Lengths, Transfer-Encoding, Content-Encoding, bodies where they mean nothing (GET), versions other than 1.0
/// and 1.1. RFC 9112 sections 2 to 6, RFC 9110 section 5; where those permit leniency we take none.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/http/problem.h"

namespace http {

struct HeadLimits {
  std::size_t request_line_bytes = 8192;  ///< what every server grants
  std::size_t target_bytes = 2048;        ///< the router matches by recursion; our longest honest target has 300
  std::size_t header_count = 64;          ///< browsers send 15, proxies add 10
  std::size_t header_bytes = 16384;       ///< of all header lines together
  std::uint64_t body_bytes = 64u << 20;
  std::uint64_t asset_bytes = 256'000'000;  ///< of a PUT: what is uploaded is not parsed here
};

using Pairs = std::vector<std::pair<std::string, std::string>>;

struct RequestHead {
  std::string method;  ///< GET HEAD POST PUT PATCH DELETE OPTIONS
  std::string path;    ///< as sent, up to '?'; printable ASCII, starts with '/'
  Pairs query;         ///< percent-decoded, in order
  Pairs headers;       ///< names in lower case, values trimmed, in order
  std::optional<std::uint64_t> content_length;
  bool keep_alive = true;
  bool expects_continue = false;
  std::size_t size_bytes = 0;  ///< of the head, its empty line included: the body starts here

  /// The first value of a header, `name` in lower case.
  [[nodiscard]] std::optional<std::string_view> header(std::string_view name) const;
};

struct Incomplete {};
struct RefusedHead {
  Failure failure;
  std::string detail;
};
using HeadResult = std::variant<Incomplete, RequestHead, RefusedHead>;

/// The verdict on `bytes`, the beginning of what a connection sent. Lines are judged in order as they complete, so the
/// verdict does not depend on how the bytes were cut into packets; it is Incomplete only within the limits.
HeadResult read_head(std::string_view bytes, const HeadLimits& limits);

/// Percent-decodes. Nothing when an escape is malformed or gives a control character.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace http
