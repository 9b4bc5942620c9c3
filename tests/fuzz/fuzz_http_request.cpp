/// Arbitrary bytes through the HTTP request checker: it must not crash, must decide the same however the bytes were
/// split, and accepted requests must be unambiguous.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "server/http/header_text.h"
#include "server/http/request_head.h"
#include "tests/fuzz/require.h"

namespace {

bool has_control(std::string_view text, bool tab_allowed) {
  return std::any_of(text.begin(), text.end(), [&](char c) {
    return (static_cast<unsigned char>(c) < 0x20 && !(tab_allowed && c == '\t')) || c == 0x7f;
  });
}

void check(const http::RequestHead& head, std::string_view bytes, const http::HeadLimits& limits) {
  require(head.size_bytes <= bytes.size(), "a head ends within the bytes");
  require(bytes.substr(0, head.size_bytes).ends_with("\r\n\r\n"), "a head ends with an empty line");
  require(head.headers.size() <= limits.header_count, "no more headers than the limit");
  require(head.path.starts_with('/') && !has_control(head.path, false), "a path starts with a slash, without controls");
  require(head.content_length.value_or(0) <= (head.method == "PUT" ? limits.asset_bytes : limits.body_bytes),
          "no body beyond the limit");
  require(!head.header("transfer-encoding"), "no second way to frame the body");
  std::size_t lengths = 0;
  for (const auto& [name, value] : head.headers) {
    require(!name.empty() && !has_control(name, false) && !has_control(value, true), "headers hold no controls");
    lengths += name == "content-length" ? 1 : 0;
  }
  require(lengths == (head.content_length ? 1 : 0), "one length or none");
  for (const auto& [name, value] : head.query) {
    require(!has_control(name, false) && !has_control(value, false), "the query decodes to no controls");
  }
}

void check_negotiation(const http::RequestHead& head) {
  http::best_offer(head.header("accept"), {"image/png", "image/x-exr"});
  http::none_match_names(head.header("if-none-match").value_or(""), "\"a\"");
  http::is_json(head.header("content-type").value_or(""));
  const auto answer = http::read_range(head.header("range"), 1000);
  if (answer.kind != http::RangeAnswer::Kind::part) return;
  require(answer.range.begin < answer.range.end && answer.range.end <= 1000, "a range lies within the bytes");
}

/// The decision is reached at the first sufficient prefix and does not change with more bytes.
void check_cuts(std::string_view bytes, const http::HeadLimits& limits) {
  const auto whole = http::read_head(bytes, limits);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto part = http::read_head(bytes.substr(0, size), limits);
    if (std::holds_alternative<http::Incomplete>(part)) continue;
    require(part.index() == whole.index(), "the verdict does not depend on how the bytes were cut");
    if (const auto* refused = std::get_if<http::Problem>(&part)) {
      require(refused->failure == std::get<http::Problem>(whole).failure, "nor does the reason");
    }
    return;
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<char> copy(data, data + size);  // of exactly this size: reading beyond its end is seen
  const std::string_view bytes(copy.data(), copy.size());
  http::HeadLimits narrow;
  narrow.request_line_bytes = 60;
  narrow.target_bytes = 40;
  narrow.header_count = 4;
  narrow.header_bytes = 200;
  for (const http::HeadLimits& limits : {http::HeadLimits{}, narrow}) {
    const auto result = http::read_head(bytes, limits);
    if (const auto* head = std::get_if<http::RequestHead>(&result)) {
      check(*head, bytes, limits);
      check_negotiation(*head);
    }
    if (const auto* refused = std::get_if<http::Problem>(&result)) {
      require(!refused->detail.empty(), "a refusal has a sentence");
    }
    if (bytes.size() <= 2048) check_cuts(bytes, limits);
  }
  return 0;
}
