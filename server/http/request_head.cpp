#include "server/http/request_head.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "server/http/header_text.h"

namespace http {
namespace {

using Refusal = std::optional<Problem>;

Problem bad(std::string detail) { return {failures::bad_request, std::move(detail)}; }

/// RFC 9110, section 5.6.2.
bool is_token_char(char c) {
  const bool alphanumeric = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  return alphanumeric || (c != '\0' && std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos);
}
bool is_token(std::string_view text) { return !text.empty() && std::ranges::all_of(text, is_token_char); }

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

Refusal read_version(std::string_view text, RequestHead& head) {
  const auto digit = [&](std::size_t i) { return text[i] >= '0' && text[i] <= '9'; };
  if (text.size() != 8 || !text.starts_with("HTTP/") || !digit(5) || text[6] != '.' || !digit(7)) {
    return bad("the request line must be METHOD SP TARGET SP HTTP/1.1");
  }
  if (text != "HTTP/1.1" && text != "HTTP/1.0") {
    return Problem{failures::version_not_supported, std::string(text) + " is not supported"};
  }
  head.keep_alive = text == "HTTP/1.1";
  return std::nullopt;
}

Refusal read_query(std::string_view text, RequestHead& head) {
  while (!text.empty()) {
    const std::string_view pair = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), pair.size() + 1));
    if (pair.empty()) continue;
    const std::size_t equals = pair.find('=');
    auto name = percent_decoded(pair.substr(0, equals));
    auto value = percent_decoded(equals == std::string_view::npos ? std::string_view{} : pair.substr(equals + 1));
    if (!name || !value) return bad("the query has a bad percent escape");
    if (*name == "ticket") {
      head.ticket = *std::move(value);
    } else {
      head.query.emplace_back(*std::move(name), *std::move(value));
    }
  }
  return std::nullopt;
}

Refusal read_target(std::string_view target, const HeadLimits& limits, RequestHead& head) {
  if (target.size() > limits.target_bytes) {
    return Problem{failures::target_too_long, "the target has " + std::to_string(target.size()) +
                                                  " bytes, the limit is " + std::to_string(limits.target_bytes)};
  }
  if (!target.starts_with('/')) return bad("the target must be an absolute path");
  const bool plain = std::ranges::all_of(target, [](char c) { return c > 0x20 && c < 0x7f && c != '#'; });
  if (!plain) return bad("the target must be printable ASCII without a fragment; escape other bytes as %XX");
  const std::string_view path = target.substr(0, target.find('?'));
  if (path.find('\\') != std::string_view::npos) return bad("the path must not contain a backslash");
  const auto decoded = percent_decoded(path);
  if (!decoded) return bad("the path has a bad percent escape");
  if (std::ranges::count(*decoded, '/') != std::ranges::count(path, '/')) {
    return bad("the path must not contain an escaped slash");
  }
  head.path = path;
  return read_query(path.size() == target.size() ? std::string_view{} : target.substr(path.size() + 1), head);
}

Refusal read_request_line(std::string_view line, const HeadLimits& limits, RequestHead& head) {
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) {
    return bad("the request line must be METHOD SP TARGET SP HTTP/1.1");
  }
  const std::string_view method = line.substr(0, first);
  if (!is_token(method)) return bad("the method must be a token");
  if (auto refused = read_version(line.substr(last + 1), head)) return refused;
  constexpr std::array<std::string_view, 7> known{"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};
  if (std::ranges::find(known, method) == known.end()) {
    return Problem{failures::not_implemented, std::string(method.substr(0, 32)) + " is not supported"};
  }
  head.method = method;
  return read_target(line.substr(first + 1, last - first - 1), limits, head);
}

Refusal read_header_line(std::string_view line, RequestHead& head) {
  if (line.front() == ' ' || line.front() == '\t') return bad("a header must not continue on a second line");
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon))) {
    return bad("a header line must be NAME: VALUE");
  }
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (std::ranges::any_of(value, [](char c) { return is_control(c) && c != '\t'; })) {
    return bad("a header value must not contain control characters");
  }
  head.headers.emplace_back(lowered(line.substr(0, colon)), value);
  return std::nullopt;
}

Refusal read_content_length(std::string_view text, const HeadLimits& limits, RequestHead& head) {
  if (text.empty() || !std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; })) {
    return bad("Content-Length must be one decimal number");
  }
  const bool is_upload = head.method == "PUT";
  const std::uint64_t limit = is_upload ? limits.asset_bytes : limits.body_bytes;
  const auto length = parse_number<std::uint64_t>(text);
  if (!length || *length > limit) {
    return Problem{failures::body_too_large, "the body has " + std::string(text.substr(0, 24)) + " bytes, the limit " +
                                                 (is_upload ? "asset_bytes" : "body_bytes") + " is " +
                                                 std::to_string(limit)};
  }
  head.content_length = *length;
  return std::nullopt;
}

/// All Connection headers count; close overrides keep-alive.
void read_connection(RequestHead& head) {
  bool close = false;
  for (const auto& [name, value] : head.headers) {
    if (name != "connection") continue;
    for (std::string_view rest = value; !rest.empty();) {
      const std::string option = lowered(take_until(rest, ','));
      close = close || option == "close";
      head.keep_alive = head.keep_alive || option == "keep-alive";
    }
  }
  head.keep_alive = head.keep_alive && !close;
}

/// A name or address with an optional port, without characters of other headers, paths or user information.
bool is_host(std::string_view text) {
  return !text.empty() && text.size() <= 255 && std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (lowered(c) >= 'a' && lowered(c) <= 'z') ||
           (c != '\0' && std::string_view("-._:[]%~").find(c) != std::string_view::npos);
  });
}

/// Checks the headers together: framing of the body, and persistence of the connection.
Refusal check_headers(const HeadLimits& limits, bool http_1_1, RequestHead& head) {
  const auto count = [&](std::string_view name) {
    return std::ranges::count(head.headers, name, &Pairs::value_type::first);
  };
  for (const std::string_view single : {"host", "content-length", "content-type", "authorization", "range", "expect"}) {
    if (count(single) > 1) return bad("the header " + std::string(single) + " is given more than once");
  }
  const auto host = head.header("host");
  if (http_1_1 && !host) return bad("the header host is missing");
  if (host && !is_host(*host)) return bad("the header host must be a name or an address with an optional port");

  const auto length = head.header("content-length");
  if (head.header("transfer-encoding")) {
    if (length || !http_1_1) return bad("Transfer-Encoding is not supported");
    return Problem{failures::length_required, "Transfer-Encoding is not supported; send Content-Length"};
  }
  if (head.header("content-encoding")) {
    return Problem{failures::unsupported_encoding, "send the body without Content-Encoding"};
  }
  if (length) {
    if (auto refused = read_content_length(*length, limits, head)) return refused;
  }
  const bool bodiless = head.method == "GET" || head.method == "HEAD" || head.method == "OPTIONS";
  if (bodiless && head.content_length.value_or(0) > 0) return bad(head.method + " must not have a body");
  if (const auto expect = head.header("expect")) {
    if (lowered(*expect) != "100-continue") {
      return Problem{failures::expectation_failed, "the only supported expectation is 100-continue"};
    }
    head.expects_continue = http_1_1 && head.content_length.value_or(0) > 0;
  }
  read_connection(head);
  return std::nullopt;
}

/// The next line without its CRLF. `line` is unset while it is incomplete.
struct LineResult {
  std::optional<std::string_view> line;
  Refusal refused;
};
LineResult next_line(std::string_view rest, std::size_t bytes_max, Failure too_long) {
  const std::size_t end = rest.substr(0, bytes_max + 2).find('\n');
  if (end == std::string_view::npos) {
    if (rest.size() < bytes_max + 2) return {};
    return {{}, Problem{too_long, "a line of the head exceeds the limit of " + std::to_string(bytes_max) + " bytes"}};
  }
  if (end == 0 || rest[end - 1] != '\r') return {{}, bad("lines must end with CR LF")};
  const std::string_view line = rest.substr(0, end - 1);
  if (line.find('\r') != std::string_view::npos) return {{}, bad("a line must not contain CR")};
  return {line, {}};
}

}  // namespace

std::string_view repeated_name(const Pairs& pairs) {
  std::set<std::string_view> names;
  for (const auto& [name, value] : pairs)
    if (!names.insert(name).second && name != "label") return name;
  return {};
}

std::optional<std::string_view> RequestHead::header(std::string_view name) const {
  const auto found = std::ranges::find(headers, name, &Pairs::value_type::first);
  if (found == headers.end()) return std::nullopt;
  return found->second;
}

std::optional<std::string> percent_decoded(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    const char* const digits = text.data() + i + 1;
    unsigned decoded = 0;
    if (i + 2 >= text.size() || std::from_chars(digits, digits + 2, decoded, 16).ptr != digits + 2) return std::nullopt;
    result += static_cast<char>(decoded);
    if (is_control(result.back())) return std::nullopt;
    i += 2;
  }
  return result;
}

HeadResult read_head(std::string_view bytes, const HeadLimits& limits) {
  RequestHead head;
  const LineResult first = next_line(bytes, limits.request_line_bytes, failures::target_too_long);
  if (first.refused) return *first.refused;
  if (!first.line) return Incomplete{};
  if (auto refused = read_request_line(*first.line, limits, head)) return *refused;
  const bool http_1_1 = first.line->ends_with('1');

  const std::size_t headers_begin = first.line->size() + 2;
  for (std::size_t at = headers_begin;;) {
    const std::size_t left = limits.header_bytes - (at - headers_begin);
    const LineResult next = next_line(bytes.substr(at), left, failures::headers_too_large);
    if (next.refused) return *next.refused;
    if (!next.line) return Incomplete{};
    at += next.line->size() + 2;
    if (next.line->empty()) {
      head.size_bytes = at;
      break;
    }
    if (at - headers_begin > limits.header_bytes || head.headers.size() == limits.header_count) {
      return Problem{failures::headers_too_large, "the limits are " + std::to_string(limits.header_count) +
                                                      " headers and " + std::to_string(limits.header_bytes) +
                                                      " bytes of them"};
    }
    if (auto refused = read_header_line(*next.line, head)) return *refused;
  }
  if (auto refused = check_headers(limits, http_1_1, head)) return *refused;
  return head;
}

}  // namespace http
