/// Times in RFC 3339.

#include <charconv>
#include <chrono>

#include "api/src/reader/field_values.h"
#include "api/src/reader/issue_text.h"

namespace api {
namespace {

constexpr std::string_view digits = "0123456789";

/// True if `text` begins with a digit for each 0 of `pattern`, any character for each ?, and else the same characters.
bool matches(std::string_view text, std::string_view pattern) {
  return text.size() >= pattern.size() && std::equal(pattern.begin(), pattern.end(), text.begin(), [](char p, char c) {
           return p == '?' || (p == '0' ? digits.find(c) != digits.npos : p == c);
         });
}

int number(std::string_view text) {
  int value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::optional<std::int64_t> unix_ms_of(std::string_view text) {
  if (!matches(text, "0000-00-00?00:00:00") || text.find_first_of("Tt ", 10) != 10) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(number(text.substr(0, 4))),
                                         std::chrono::month(static_cast<unsigned>(number(text.substr(5, 2)))),
                                         std::chrono::day(static_cast<unsigned>(number(text.substr(8, 2))))};
  const int hour = number(text.substr(11, 2)), minute = number(text.substr(14, 2)), second = number(text.substr(17, 2));
  if (!date.ok() || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  std::string_view rest = text.substr(19);
  int milliseconds = 0;
  if (rest.starts_with('.')) {
    const std::string_view fraction = rest.substr(1, std::min(rest.find_first_not_of(digits, 1), rest.size()) - 1);
    if (fraction.empty()) return std::nullopt;
    milliseconds =
        number(std::string(fraction.substr(0, 3)).append(3 - std::min<std::size_t>(3, fraction.size()), '0'));
    rest.remove_prefix(1 + fraction.size());
  }
  int offset_minutes = 0;
  if (rest.size() == 6 && (matches(rest, "+00:00") || matches(rest, "-00:00"))) {
    const int offset_hour = number(rest.substr(1, 2)), offset_minute = number(rest.substr(4, 2));
    if (offset_hour > 23 || offset_minute > 59) return std::nullopt;
    offset_minutes = (rest[0] == '-' ? -1 : 1) * (offset_hour * 60 + offset_minute);
  } else if (rest != "Z" && rest != "z") {
    return std::nullopt;
  }
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  const std::int64_t ms = (((days * 24 + hour) * 60 + minute - offset_minutes) * 60 + second) * 1000 + milliseconds;
  return date.year() >= std::chrono::year(1970) && ms >= 0 ? std::optional(ms) : std::nullopt;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, Time time) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a string");
  time.value = unix_ms_of(at.node->string());
  return time.value.has_value() ||
         add_issue(reading, at, "malformed",
                   "must be a time such as \"2030-01-31T18:00:00Z\" (RFC 3339, 1970 to 9999), got " +
                       quoted(at.node->string()));
}

}  // namespace api
