#pragma once
/// Texts of a plot: made safe to draw, measured, cut and wrapped, without asking any font.

#include <string>
#include <string_view>
#include <vector>

namespace tracer::plotting {

/// `text` with everything replaced by U+FFFD that is not UTF-8 (RFC 3629) or not a character of XML 1.0, section 2.2,
/// and with control characters; so both writers can draw the answer.
std::string drawable(std::string_view text);

/// About what it takes in DejaVu Sans, pixels; rather more than less. The writers of SVG do not know what font a reader
/// has, and this one is wider than most. Precondition: UTF-8.
double text_width(std::string_view text, double size);

/// As much of `text` as takes at most `width`, "…" at the end where something was cut.
std::string cut(std::string_view text, double size, double width);

/// Broken at spaces into at most `most` lines of at most `width`; the last, and single words, are cut.
std::vector<std::string> wrapped(std::string_view text, double size, double width, std::size_t most);

/// Four significant digits, for tooltips and descriptions: "0.01235", "1.2e-07".
std::string brief(double value);

}  // namespace tracer::plotting
