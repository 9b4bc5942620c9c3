/// The four forms of a color: [r, g, b] and a gray number (linear), "#rrggbb" and {"hsb"} (sRGB, decoded to linear).

#include <charconv>
#include <cmath>
#include <string>

#include "api/src/reader/field_values.h"
#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"

namespace api {
namespace {

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

bool read_hex(Reading& reading, const Cursor& at, tracer::Color& color) {
  const std::string_view text = at.node->string();
  tracer::Color encoded;
  if (text.size() != 7 || text[0] != '#' || !read_hex_byte(text.substr(1, 2), encoded.r) ||
      !read_hex_byte(text.substr(3, 2), encoded.g) || !read_hex_byte(text.substr(5, 2), encoded.b))
    return add_issue(reading, at, "malformed", "a colour as text must be \"#rrggbb\", got " + quoted(text));
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

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::Color& value) {
  bool valid = false;
  switch (at.node->kind) {
    case json::Kind::number:
      valid = read(reading, at, value.r);
      value = {value.r, value.r, value.r};
      break;
    case json::Kind::array: {
      std::array<double, 3> rgb{};
      valid = read(reading, at, rgb);
      value = {rgb[0], rgb[1], rgb[2]};
      break;
    }
    case json::Kind::string:
      valid = read_hex(reading, at, value);
      break;
    case json::Kind::object:
      valid = read_hsb(reading, at, value);
      break;
    default:
      add_wrong_type(reading, at, "a colour ([r, g, b], a number, \"#rrggbb\" or {\"hsb\": [h, s, b]})");
  }
  if (!valid) set_invalid(value);
  return valid;
}

}  // namespace api
