/// The four forms of a colour: [r,g,b] and a grey number (linear), "#rrggbb" and {"hsb"} (sRGB, decoded to linear).

#include <cmath>

#include "api/src/reader/field_values.h"
#include "api/src/reader/fields.h"

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

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool read_hex(Reading& reading, const Cursor& at, tracer::Color& color) {
  const std::string_view text = at.node->string();
  bool valid = text.size() == 7 && text[0] == '#';
  double channels[3] = {};
  for (std::size_t i = 0; valid && i < 3; ++i) {
    const int high = hex_digit(text[1 + 2 * i]), low = hex_digit(text[2 + 2 * i]);
    valid = high >= 0 && low >= 0;
    channels[i] = (high * 16 + low) / 255.0;
  }
  if (!valid) {
    add_issue(reading, at, "malformed", "a colour as text must be \"#rrggbb\", got " + quoted(text));
    return false;
  }
  color = linear_from_srgb(tracer::Color{channels[0], channels[1], channels[2]});
  return true;
}

bool read_unit(Reading& reading, const Cursor& at, std::string_view what, double value) {
  if (value >= 0 && value <= 1) return true;
  add_issue(reading, at, "out_of_range", std::string(what) + " must be in [0, 1], got " + number_text(value));
  return false;
}

bool read_hsb(Reading& reading, const Cursor& at, tracer::Color& color) {
  Fields fields(reading, at, "a colour");
  std::array<double, 3> hsb{};
  bool valid = false;
  if (const auto field = fields.take("hsb")) {
    valid = read(reading, *field, hsb);
    if (valid) {
      json::Node* const numbers = field->node + 1;
      const bool saturation = read_unit(reading, {&*field, {}, 1, false, numbers + 1}, "saturation", hsb[1]);
      const bool brightness = read_unit(reading, {&*field, {}, 2, false, numbers + 2}, "brightness", hsb[2]);
      valid = saturation && brightness;
    }
  } else {
    fields.report_missing_field("hsb");
  }
  fields.finish();
  if (valid) color = linear_from_srgb(srgb_from_hsb(hsb[0], hsb[1], hsb[2]));
  return valid;
}

bool read_form(Reading& reading, const Cursor& at, tracer::Color& color) {
  switch (at.node->kind) {
    case json::Kind::number: {
      double grey = 0;
      const bool valid = read(reading, at, grey);
      color = {grey, grey, grey};
      return valid;
    }
    case json::Kind::array: {
      std::array<double, 3> rgb{};
      const bool valid = read(reading, at, rgb);
      color = {rgb[0], rgb[1], rgb[2]};
      return valid;
    }
    case json::Kind::string:
      return read_hex(reading, at, color);
    case json::Kind::object:
      return read_hsb(reading, at, color);
    default:
      add_wrong_type(reading, at, "a colour ([r, g, b], a number, \"#rrggbb\" or {\"hsb\": [h, s, b]})");
      return false;
  }
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::Color& value) {
  if (read_form(reading, at, value)) return true;
  set_nan(value);
  return false;
}

}  // namespace api
