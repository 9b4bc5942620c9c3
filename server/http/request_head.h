#pragma once
/// Parses and checks the head of an HTTP/1.x request: a pure function over untrusted bytes. Accepted heads are
/// unambiguous, so that no later stage can frame or route the request in another way (request smuggling).
///
/// Refused are: line ends other than CRLF, control characters, obs-fold, white space before a colon, targets other than
/// absolute paths, the escapes %00-%1F, %7F and %2F, a missing or repeated Host, several or non-decimal
/// Content-Lengths, Transfer-Encoding, Content-Encoding, bodies without meaning (GET), versions other than 1.0 and 1.1.
/// RFC 9112 sections 2 to 6, RFC 9110 section 5; where they permit leniency, none is granted.

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
  std::size_t request_line_bytes = 8192;  ///< RFC 9112, section 3, recommends at least 8000
  std::size_t target_bytes = 2048;        ///< the longest target of the API has 300
  std::size_t header_count = 64;          ///< browsers send 15, proxies add 10
  std::size_t header_bytes = 16384;       ///< all header lines together
  std::uint64_t body_bytes = 64u << 20;
  std::uint64_t asset_bytes = 256'000'000;  ///< the body of a PUT: uploads are not parsed by the daemon
};

using Pairs = std::vector<std::pair<std::string, std::string>>;

struct RequestHead {
  std::string method;  ///< GET HEAD POST PUT PATCH DELETE OPTIONS
  std::string path;    ///< as received, up to '?'; printable ASCII, starts with '/'
  Pairs query;         ///< percent-decoded, in order, without `ticket`
  std::string ticket;  ///< the parameter "ticket" of the query, which stands for a key: see keys/key_ring.h
  Pairs headers;       ///< names in lower case, values trimmed, in order
  std::optional<std::uint64_t> content_length;
  bool keep_alive = true;
  bool expects_continue = false;
  std::size_t size_bytes = 0;  ///< the head with its empty line: offset of the body

  /// The first value of a header, `name` in lower case.
  [[nodiscard]] std::optional<std::string_view> header(std::string_view name) const;
};

struct Incomplete {};
using HeadResult = std::variant<Incomplete, RequestHead, Problem>;

/// Parses `bytes`, the beginning of the input of a connection. Lines are checked in order as they complete, so the
/// result does not depend on the division of the bytes into packets. It is Incomplete only within the limits.
HeadResult read_head(std::string_view bytes, const HeadLimits& limits);

/// The first name that comes again; empty if there is none. `label` may.
std::string_view repeated_name(const Pairs& pairs);

/// Percent-decodes. Nothing if an escape is malformed or encodes a control character.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace http
