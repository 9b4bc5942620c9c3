#include "server/http/header_text.h"

namespace http {
namespace {

/// A weight in thousandths, "0.75" as 750; nothing if it is invalid (RFC 9110, section 12.4.2).
std::optional<int> thousandths(std::string_view text) {
  if (text.empty() || text.size() > 5 || (text[0] != '0' && text[0] != '1')) return std::nullopt;
  if (text.size() > 1 && text[1] != '.') return std::nullopt;
  int value = (text[0] - '0') * 1000;
  for (std::size_t i = 2, unit = 100; i < text.size(); ++i, unit /= 10) {
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    value += (text[i] - '0') * static_cast<int>(unit);
  }
  return value <= 1000 ? std::optional(value) : std::nullopt;
}

/// A member of Accept or Accept-Encoding.
struct WeightedValue {
  std::string value;  ///< "image/png", "image/*", "*/*", "gzip"
  int weight = 1000;
};

std::optional<WeightedValue> read_weighted_value(std::string_view member) {
  WeightedValue read{lowered(take_until(member, ';'))};
  while (!member.empty()) {
    const std::string parameter = lowered(take_until(member, ';'));
    if (!parameter.starts_with("q=")) continue;
    const auto weight = thousandths(std::string_view(parameter).substr(2));
    if (!weight) return std::nullopt;
    read.weight = *weight;
  }
  return read;
}

/// Precision with which `range` describes `type`: 0 no match, 3 exact.
int specificity(const std::string& range, std::string_view type) {
  if (range == type) return 3;
  if (range == std::string(type.substr(0, type.find('/'))) + "/*") return 2;
  return range == "*/*" ? 1 : 0;
}

}  // namespace

std::optional<std::size_t> best_offer(std::optional<std::string_view> accept,
                                      const std::vector<std::string_view>& offers) {
  std::vector<WeightedValue> ranges;
  for (std::string_view rest = accept.value_or(""); !rest.empty();) {
    auto range = read_weighted_value(take_until(rest, ','));
    if (range && range->value.find('/') != std::string::npos) ranges.push_back(std::move(*range));
  }
  if (trimmed(accept.value_or("")).empty()) ranges.push_back({"*/*"});

  std::optional<std::size_t> best;
  int best_weight = 0;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    int weight = 0, closest = 0;
    for (const WeightedValue& range : ranges) {
      const int close = specificity(range.value, offers[i]);
      if (close > closest) {
        closest = close;
        weight = range.weight;
      }
    }
    if (weight > best_weight) {
      best = i;
      best_weight = weight;
    }
  }
  return best;
}

bool accepts_gzip(std::optional<std::string_view> accept_encoding) {
  std::optional<bool> named;
  bool others = false;
  for (std::string_view rest = accept_encoding.value_or(""); !rest.empty();) {
    const auto coding = read_weighted_value(take_until(rest, ','));
    if (coding && (coding->value == "gzip" || coding->value == "x-gzip")) named = coding->weight > 0;
    if (coding && coding->value == "*") others = coding->weight > 0;
  }
  return named.value_or(others);
}

RangeAnswer read_range(std::optional<std::string_view> range, std::uint64_t size_bytes) {
  using Kind = RangeAnswer::Kind;
  if (!range || !range->starts_with("bytes=")) return {};
  const std::string_view spec = trimmed(range->substr(6));
  const std::size_t dash = spec.find('-');
  if (dash == std::string_view::npos || spec.find(',') != std::string_view::npos) return {};
  const std::string_view first = spec.substr(0, dash), last = spec.substr(dash + 1);

  if (first.empty()) {  // the last N bytes
    const auto count = parse_number<std::uint64_t>(last);
    if (!count) return {};
    if (*count == 0 || size_bytes == 0) return {Kind::unsatisfiable, {}};
    return {Kind::part, {size_bytes - std::min(*count, size_bytes), size_bytes}};
  }
  const auto begin = parse_number<std::uint64_t>(first);
  const auto end = last.empty() ? std::optional(UINT64_MAX) : parse_number<std::uint64_t>(last);
  if (!begin || !end || *end < *begin) return {};
  if (*begin >= size_bytes) return {Kind::unsatisfiable, {}};
  return {Kind::part, {*begin, std::min(*end, size_bytes - 1) + 1}};
}

std::optional<std::chrono::seconds> preferred_wait(std::string_view prefer) {
  while (!prefer.empty()) {
    std::string_view preference = take_until(prefer, ',');
    std::string_view value = take_until(preference, ';');
    if (lowered(take_until(value, '=')) != "wait") continue;
    value = trimmed(value);
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    const auto seconds = parse_number<std::uint64_t>(value);
    constexpr std::uint64_t year = 31'536'000;  // a longer wait makes no difference, and larger numbers could overflow
    return seconds ? std::optional(std::chrono::seconds(std::min(*seconds, year))) : std::nullopt;
  }
  return std::nullopt;
}

bool none_match_names(std::optional<std::string_view> if_none_match, std::string_view etag) {
  std::string_view rest = if_none_match.value_or("");
  if (trimmed(rest) == "*") return true;
  if (etag.starts_with("W/")) etag.remove_prefix(2);
  while (!rest.empty()) {
    std::string_view member = take_until(rest, ',');
    if (member.starts_with("W/")) member.remove_prefix(2);
    if (member == etag) return true;
  }
  return false;
}

bool is_json(std::string_view content_type, std::string_view media_type) {
  if (lowered(take_until(content_type, ';')) != media_type) return false;
  while (!content_type.empty()) {
    const std::string parameter = lowered(take_until(content_type, ';'));
    if (!parameter.starts_with("charset=")) continue;
    if (parameter != "charset=utf-8" && parameter != "charset=\"utf-8\"") return false;
  }
  return true;
}

}  // namespace http
