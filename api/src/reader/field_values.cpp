#include "api/reader/field_values.h"

#include <charconv>
#include <chrono>
#include <cmath>
#include <string>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/src/reader/color_names.h"

namespace api {
namespace {

/// Reads an array of N finite numbers without a cursor for each: the common case, in meshes by far.
template <std::size_t N>
bool read_vector(Reading& reading, const Cursor& at, std::array<double, N>& values, std::string_view form) {
  bool plain = at.node->kind == json::Kind::array && at.node->size == N;
  for (std::size_t i = 0; plain && i < N; ++i) {
    const json::Node& element = at.node[1 + i];  // numbers take one node each
    plain = element.kind == json::Kind::number && std::isfinite(element.number);
    values[i] = element.number;
  }
  if (plain) return true;
  if (expect_length(reading, at, N, form)) return read<double, N>(reading, at, values);
  set_invalid(values[0]);
  return false;
}

// The forms of a color: [r, g, b] and a gray number (linear); text and {"hsb"} (sRGB, decoded to linear).

/// IEC 61966-2-1.
double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

tracer::Color linear_from_srgb(const tracer::Color& encoded) {
  return {linear_from_srgb(encoded.r), linear_from_srgb(encoded.g), linear_from_srgb(encoded.b)};
}

/// Smith 1978, "Color gamut transform pairs", in the closed form k = (n + hue/60) mod 6,
/// f(n) = b - b s max(0, min(k, 4 - k, 1)) for n = 5, 3, 1.
tracer::Color srgb_from_hsb(double hue_deg, double saturation, double brightness) {
  double sextant = std::fmod(hue_deg, 360.0) / 60;
  if (sextant < 0) sextant += 6;
  const auto channel = [&](double n) {
    const double k = std::fmod(n + sextant, 6.0);
    return brightness - brightness * saturation * std::max(0.0, std::min({k, 4 - k, 1.0}));
  };
  return {channel(5), channel(3), channel(1)};
}

/// The value of two hexadecimal digits; false if they are none.
bool read_hex_byte(std::string_view digits, double& channel) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  channel = value / 255.0;
  return error == std::errc() && end == digits.data() + digits.size();
}

/// "#rrggbb", "#rgb" for "#rrggbb" with each digit twice, or a name.
bool read_color_text(Reading& reading, const Cursor& at, tracer::Color& color) {
  const std::string_view text = at.node->string();
  std::string digits(text.starts_with('#') ? text.substr(1) : "");
  if (digits.size() == 3) digits = {digits[0], digits[0], digits[1], digits[1], digits[2], digits[2]};
  tracer::Color encoded;
  const bool is_hex = digits.size() == 6 && read_hex_byte(digits.substr(0, 2), encoded.r) &&
                      read_hex_byte(digits.substr(2, 2), encoded.g) && read_hex_byte(digits.substr(4, 2), encoded.b);
  if (const auto rgb = color_by_name(text)) {
    encoded = {(*rgb >> 16U) / 255.0, (*rgb >> 8U & 0xFFU) / 255.0, (*rgb & 0xFFU) / 255.0};
  } else if (!is_hex) {
    return reading.can_add_issue() &&
           add_issue(reading, at, "malformed",
                     "a colour as text must be \"#rrggbb\", \"#rgb\" or a CSS name such as \"red\", got " +
                         quoted(text) + did_you_mean(text, color_names()));
  }
  color = linear_from_srgb(encoded);
  return true;
}

bool read_hsb(Reading& reading, const Cursor& at, tracer::Color& color) {
  Fields fields(reading, at, "a colour");
  std::array<double, 3> hsb{};
  const auto field = fields.take_required("hsb");
  bool valid = field && read(reading, *field, hsb);
  if (valid) {
    const auto check = [&](std::size_t i, const char* component) {
      const Cursor at_component{&*field, {}, i, false, field->node + 1 + i};
      valid &= (hsb[i] >= 0 && hsb[i] <= 1) ||
               add_issue(reading, at_component, "out_of_range",
                         std::string(component) + " must be in [0, 1], got " + number_text(hsb[i]));
    };
    check(1, "saturation");
    check(2, "brightness");
  }
  fields.finish();
  if (valid) color = linear_from_srgb(srgb_from_hsb(hsb[0], hsb[1], hsb[2]));
  return valid;
}

// Times in RFC 3339.

constexpr std::string_view decimal_digits = "0123456789";

/// True if `text` begins with a digit for each 0 of `pattern`, any character for each ?, and else the same characters.
bool matches(std::string_view text, std::string_view pattern) {
  return text.size() >= pattern.size() && std::equal(pattern.begin(), pattern.end(), text.begin(), [](char p, char c) {
           return p == '?' || (p == '0' ? decimal_digits.find(c) != decimal_digits.npos : p == c);
         });
}

int number(std::string_view text) {
  int value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, double& value) {
  const bool is_number = at.node->kind == json::Kind::number;
  if (is_number && std::isfinite(at.node->number)) {
    value = at.node->number;
    return true;
  }
  set_invalid(value);
  if (!is_number) return add_wrong_type(reading, at, "a number");
  return add_issue(reading, at, "not_finite", "must be a finite number, got one too large for a double");
}

bool read(Reading& reading, const Cursor& at, bool& value) {
  if (at.node->kind != json::Kind::boolean) return add_wrong_type(reading, at, "true or false");
  value = at.node->truth;
  return true;
}

bool read(Reading& reading, const Cursor& at, std::uint32_t& value) {
  return read(reading, at, Integer<std::uint32_t>{value});
}

bool read(Reading& reading, const Cursor& at, tracer::Vec2& value) {
  std::array<double, 2> xy{};
  const bool valid = read_vector(reading, at, xy, form_of<tracer::Vec2>);
  value = {xy[0], xy[1]};
  return valid;
}

bool read(Reading& reading, const Cursor& at, tracer::Vec3& value) {
  std::array<double, 3> xyz{};
  const bool valid = read_vector(reading, at, xyz, form_of<tracer::Vec3>);
  value = {xyz[0], xyz[1], xyz[2]};
  return valid;
}

/// Names are written to logs and terminals.
bool has_control_characters(std::string_view text) {
  return std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

bool read(Reading& reading, const Cursor& at, std::string& name) {
  if (!expect_string(reading, at)) return false;
  const std::string_view text = at.node->string();
  const std::size_t bytes_max = reading.limits.document.name_bytes;
  if (text.size() > bytes_max) return add_limit_exceeded(reading, at, "name_bytes", bytes_max, text.size());
  if (has_control_characters(text)) return add_issue(reading, at, "malformed", "must not have control characters");
  name = text;
  return true;
}

bool read_integer(Reading& reading, const Cursor& at, std::int64_t least, std::int64_t most, std::int64_t& value) {
  const double number = at.node->number;
  if (at.node->kind != json::Kind::number) return add_wrong_type(reading, at, "an integer");
  if (std::isinf(number))
    return add_issue(reading, at, "not_finite", "must be an integer, got a number too large for a double");
  if (number != std::trunc(number)) return add_wrong_type(reading, at, "an integer");
  const bool is_less = number < static_cast<double>(least);
  if (is_less || number > static_cast<double>(most))
    return add_issue(reading, at, "out_of_range",
                     "must be " + (is_less ? ">= " + std::to_string(least) : "<= " + std::to_string(most)) + ", got " +
                         number_text(number));
  value = static_cast<std::int64_t>(number);
  return true;
}

bool add_unknown_word(Reading& reading, const Cursor& at, std::span<const std::string_view> choices) {
  if (!expect_string(reading, at)) return false;
  if (!reading.can_add_issue()) return false;
  const std::string_view text = at.node->string();
  reading.issues.push_back({pointer(at), at.is_member && at.key == "type" ? "unknown_type" : "unknown_value",
                            (choices.size() > 1 ? "must be one of " : "must be ") + list_of(choices) + ", got " +
                                quoted(text) + suggestion(text, "", at.is_member ? at.key : "", choices)});
  return false;
}

bool within_limit(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound) {
  if (at.node->kind < json::Kind::array || at.node->size <= bound) return true;
  return add_limit_exceeded(reading, at, limit, bound, at.node->size);
}

bool expect_string(Reading& reading, const Cursor& at, std::string_view form) {
  return at.node->kind == json::Kind::string || add_wrong_type(reading, at, form);
}

bool expect_length(Reading& reading, const Cursor& at, std::size_t length, std::string_view form) {
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, form.empty() ? "an array of " + std::to_string(length) : std::string(form));
  if (at.node->size == length) return true;
  if (!form.empty())
    return add_issue(reading, at, "wrong_length",
                     "must be " + std::string(form) + ", got an array of " + std::to_string(at.node->size));
  return add_issue(reading, at, "wrong_length",
                   "must have " + std::to_string(length) + " elements, has " + std::to_string(at.node->size));
}

bool read(Reading& reading, const Cursor& at, tracer::Color& value) {
  bool valid = false;
  switch (at.node->kind) {
    case json::Kind::number:
      valid = read(reading, at, value.r);
      value = {value.r, value.r, value.r};
      break;
    case json::Kind::array: {
      std::array<double, 3> rgb{};
      valid = expect_length(reading, at, 3, "[r, g, b]") && read(reading, at, rgb);
      value = {rgb[0], rgb[1], rgb[2]};
      break;
    }
    case json::Kind::string:
      valid = read_color_text(reading, at, value);
      break;
    case json::Kind::object:
      valid = read_hsb(reading, at, value);
      break;
    default:
      add_wrong_type(reading, at, "a colour ([r, g, b], a number, \"#rrggbb\", \"red\" or {\"hsb\": [h, s, b]})");
  }
  if (!valid) set_invalid(value);
  return valid;
}

std::optional<std::int64_t> parse_time(std::string_view text) {
  if (!matches(text, "0000-00-00?00:00:00") || text.find_first_of("Tt ", 10) != 10) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(number(text.substr(0, 4))),
                                         std::chrono::month(static_cast<unsigned>(number(text.substr(5, 2)))),
                                         std::chrono::day(static_cast<unsigned>(number(text.substr(8, 2))))};
  const int hour = number(text.substr(11, 2)), minute = number(text.substr(14, 2)), second = number(text.substr(17, 2));
  if (!date.ok() || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  std::string_view rest = text.substr(19);
  int milliseconds = 0;
  if (rest.starts_with('.')) {
    const std::string_view fraction =
        rest.substr(1, std::min(rest.find_first_not_of(decimal_digits, 1), rest.size()) - 1);
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

bool read(Reading& reading, const Cursor& at, Time time) {
  if (!expect_string(reading, at)) return false;
  time.value = parse_time(at.node->string());
  return time.value.has_value() ||
         add_issue(reading, at, "malformed",
                   "must be a time such as \"2030-01-31T18:00:00Z\" (RFC 3339, 1970 to 9999), got " +
                       quoted(at.node->string()));
}

}  // namespace api
