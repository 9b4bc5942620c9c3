#pragma once
/// Text utilities of plots: sanitizing, estimated width, cutting and wrapping, without fonts.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tracer::plotting {

inline constexpr std::string_view replacement = "\xef\xbf\xbd", ellipsis = "…";

inline bool continues(char byte) { return (static_cast<unsigned char>(byte) & 0xc0U) == 0x80; }

/// First character of `text` and its number of bytes; 0 bytes for invalid UTF-8.
struct Character {
  std::size_t bytes = 0;
  std::uint32_t code = 0;
};

inline Character first_character(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return {1, lead};
  const std::size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0xffU >> (bytes + 1));
  for (const char byte : text.substr(1, bytes - 1)) {
    if (!continues(byte)) return {};
    code = code << 6U | (static_cast<unsigned char>(byte) & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> least{0, 0, 0x80, 0x800, 0x10000};  // longer forms are invalid
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < least[bytes] || code > 0x10ffff || surrogate ? Character{} : Character{bytes, code};
}

inline bool is_drawable(std::uint32_t code) {
  const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  return !control && code != 0xfffe && code != 0xffff;
}

/// Advance widths of DejaVu Sans in em, by class of character, rounded up. Continuation bytes have width 0.
inline double advance(char byte) {
  if (continues(byte)) return 0;
  constexpr std::string_view narrow = " ,.;:'|!()[]/fijlrtI", wide = "mwMW@%+=<>~#_";
  if (narrow.find(byte) != std::string_view::npos) return 0.42;
  if (wide.find(byte) != std::string_view::npos) return 1;
  return byte >= 'A' && byte <= 'Z' ? 0.79 : 0.64;
}

/// The longest prefix of whole characters of at most `width`.
inline std::string_view fitting(std::string_view text, double size, double width) {
  double em = 0;
  for (std::size_t end = 0; end < text.size(); ++end) {
    em += advance(text[end]);
    if (em * size > width) return text.substr(0, end);
  }
  return text;
}

/// `text` with U+FFFD in place of invalid UTF-8 (RFC 3629), characters that XML 1.0, section 2.2 excludes, and control
/// characters: safe for both writers.
inline std::string drawable(std::string_view text) {
  std::string safe;
  while (!text.empty()) {
    const Character character = first_character(text);
    const bool kept = character.bytes > 0 && is_drawable(character.code);
    const std::size_t taken = character.bytes > 0 ? character.bytes : 1;
    safe += kept ? text.substr(0, taken) : replacement;
    text.remove_prefix(taken);
  }
  return safe;
}

/// Estimated width in DejaVu Sans, pixels, rounded up. The font of an SVG viewer is unknown, and this one is wider than
/// most. Precondition: UTF-8.
inline double text_width(std::string_view text, double size) {
  double em = 0;
  for (const char byte : text) em += advance(byte);
  return em * size;
}

/// `text` cut to at most `width`, with "…" at the end if it was cut.
inline std::string cut(std::string_view text, double size, double width) {
  if (fitting(text, size, width).size() == text.size()) return std::string(text);
  const double rest = width - text_width(ellipsis, size);
  return rest < 0 ? "" : std::string(fitting(text, size, rest)).append(ellipsis);
}

/// Wraps at spaces into at most `most` lines of at most `width`; the last line and single long words are cut.
inline std::vector<std::string> wrapped(std::string_view text, double size, double width, std::size_t most) {
  std::vector<std::string> lines;
  while (!text.empty() && lines.size() + 1 < most) {
    const std::string_view line = fitting(text, size, width);
    // A space that does not fit ends the line too.
    const std::size_t space = line.size() == text.size() ? std::string_view::npos : text.rfind(' ', line.size());
    if (space == std::string_view::npos || space == 0) break;
    lines.emplace_back(text.substr(0, space));
    text.remove_prefix(space + 1);
  }
  if (!text.empty()) lines.push_back(cut(text, size, width));
  return lines;
}

}  // namespace tracer::plotting
