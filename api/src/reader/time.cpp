/// Times as RFC 3339 writes them.

#include <chrono>
#include <optional>

#include "api/src/reader/field_values.h"

namespace api {
namespace {

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes what it reads off the front of a text; once something did not fit, nothing does any more.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  int number(std::size_t digits, int least, int most) {
    int value = 0;
    for (std::size_t i = 0; i < digits; ++i) {
      if (rest_.empty() || !is_digit(rest_.front())) return fail();
      value = value * 10 + (rest_.front() - '0');
      rest_.remove_prefix(1);
    }
    return value < least || value > most ? fail() : value;
  }
  bool next_is(std::string_view any_of) { return !rest_.empty() && any_of.find(rest_.front()) != any_of.npos; }
  char one_of(std::string_view characters) {
    if (!next_is(characters)) return static_cast<char>(fail());
    const char c = rest_.front();
    rest_.remove_prefix(1);
    return c;
  }
  int milliseconds() {
    if (!next_is(".")) return 0;
    one_of(".");
    int value = 0, scale = 100;
    if (!next_is("0123456789")) return fail();
    for (; next_is("0123456789"); scale /= 10) value += (one_of("0123456789") - '0') * scale;
    return value;
  }
  [[nodiscard]] bool succeeded() const { return valid_ && rest_.empty(); }

 private:
  int fail() {
    valid_ = false;
    rest_ = {};
    return 0;
  }
  std::string_view rest_;
  bool valid_ = true;
};

std::optional<std::int64_t> unix_ms_of(std::string_view text) {
  Scanner scan(text);
  const int year = scan.number(4, 1970, 9999);
  scan.one_of("-");
  const int month = scan.number(2, 1, 12);
  scan.one_of("-");
  const int day = scan.number(2, 1, 31);
  scan.one_of("Tt ");
  const int hour = scan.number(2, 0, 23);
  scan.one_of(":");
  const int minute = scan.number(2, 0, 59);
  scan.one_of(":");
  const int second = scan.number(2, 0, 60);
  const int millisecond = scan.milliseconds();
  int offset_min = 0;
  if (scan.next_is("Zz")) {
    scan.one_of("Zz");
  } else {
    const int sign = scan.one_of("+-") == '-' ? -1 : 1;
    const int offset_hour = scan.number(2, 0, 23);
    scan.one_of(":");
    offset_min = sign * (offset_hour * 60 + scan.number(2, 0, 59));
  }
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!scan.succeeded() || !date.ok()) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  const std::int64_t ms = (((days * 24 + hour) * 60 + minute - offset_min) * 60 + second) * 1000 + millisecond;
  if (ms < 0) return std::nullopt;
  return ms;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, Time time) {
  if (at.node->kind != json::Kind::string) {
    add_wrong_type(reading, at, "a string");
    return false;
  }
  time.value = unix_ms_of(at.node->string());
  if (time.value) return true;
  add_issue(
      reading, at, "malformed",
      "must be a time such as \"2030-01-31T18:00:00Z\" (RFC 3339, 1970 to 9999), got " + quoted(at.node->string()));
  return false;
}

}  // namespace api
