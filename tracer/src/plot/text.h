#pragma once
/// Text utilities of plots: sanitizing, estimated width, cutting and wrapping, without fonts.

#include <string>
#include <string_view>
#include <vector>

namespace tracer::plotting {

/// `text` with U+FFFD in place of invalid UTF-8 (RFC 3629), characters that XML 1.0, section 2.2 excludes, and control
/// characters: safe for both writers.
std::string drawable(std::string_view text);

/// Estimated width in DejaVu Sans, pixels, rounded up. The font of an SVG viewer is unknown, and this one is wider than
/// most. Precondition: UTF-8.
double text_width(std::string_view text, double size);

/// `text` cut to at most `width`, with "…" at the end if it was cut.
std::string cut(std::string_view text, double size, double width);

/// Wraps at spaces into at most `most` lines of at most `width`; the last line and single long words are cut.
std::vector<std::string> wrapped(std::string_view text, double size, double width, std::size_t most);

/// Four significant digits, for tooltips and descriptions: "0.01235", "1.2e-07".
std::string brief(double value);

}  // namespace tracer::plotting
