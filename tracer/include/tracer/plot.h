#pragma once
/// A chart of points and lines over two axes, as the bytes of an SVG or a PNG: seconds against error, for one.
/// Pure functions of the plot; any thread. Equal plots give equal SVGs, and equal PNGs where the fonts are the same.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// Texts are UTF-8; what is none, and control characters, are shown as U+FFFD. Too long ones are cut, with "…".
struct PlotAxis {
  std::string label;  ///< with its unit: "time (s)"
  bool logarithmic = false;
};

/// Both finite, at most 1e300 in magnitude, and on a logarithmic axis at least 1e-300. Other points are left out, lines
/// pass over them, and the plot says how many they are.
struct PlotPoint {
  double x = 0, y = 0;
  std::string label{};  ///< beside the point where there is room, in its tooltip (SVG) always
};

enum class PlotMark { none, circle, square, diamond, triangle, cross };

/// How points are joined, in their order: not at all, by straight lines, by steps that keep y until the next x (what
/// was best so far), or each two of them by a line of its own (the same measurement told twice).
enum class PlotJoin { none, line, steps, pairs };

struct PlotSeries {
  std::string name;  ///< in the legend, which takes at most a third of the height; empty: not there
  std::vector<PlotPoint> points;
  PlotMark mark = PlotMark::circle;
  PlotJoin join = PlotJoin::none;
  bool dashed = false;
  std::optional<std::uint32_t> color{};  ///< 0xrrggbb; unset: the series' own, see below
};

/// Axes reach as far as the points, with a little room; linear ones from 0 where no value is negative and the least is
/// below half of the greatest. Series without a colour take, in turn, those of Okabe and Ito (2008, "Color Universal
/// Design") that are legible on white, darkest first: they can be told apart with any kind of colour vision.
struct Plot {
  std::string title;
  PlotAxis x{}, y{};
  std::vector<PlotSeries> series{};         ///< later ones are drawn over earlier ones
  std::string note{};                       ///< below the axes, at most three lines
  std::uint32_t width = 960, height = 640;  ///< pixels; at least 320 x 240, at most 8192 x 8192
};

/// Self-contained and small: shapes and text (DejaVu Sans, Verdana or what the reader has), no script, no link; with a
/// title and a description in words for those who cannot see it, and a tooltip at each mark.
std::string plot_svg(const Plot& plot);

/// The same drawing on white, 8 bits, of `width` x `height` pixels. Fails with a sentence when memory or the drawing
/// library do. Its text is of DejaVu Sans, which the library finds among the system's fonts, or of the nearest there
/// is.
Result<std::vector<std::uint8_t>, std::string> plot_png(const Plot& plot);

}  // namespace tracer
