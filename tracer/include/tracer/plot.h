#pragma once
/// Draws a chart of points and lines over two axes as SVG or PNG.
/// Pure functions, any thread. Equal plots give equal SVGs, and equal PNGs if the installed fonts are equal.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracer/result.h"

namespace tracer {

/// All texts are UTF-8; invalid sequences and control characters are drawn as U+FFFD, long texts are cut with "…".
struct PlotAxis {
  std::string label;  ///< with its unit: "time (s)"
  bool logarithmic = false;
};

/// Coordinates are finite, at most 1e300 in magnitude, and at least 1e-300 on a logarithmic axis. Other points are
/// omitted, lines join their neighbors but no points of different pairs, and the chart states their number.
struct PlotPoint {
  double x = 0, y = 0;
  std::string label{};  ///< drawn at the point if there is space; always in its tooltip (SVG)
};

enum class PlotMark { none, circle, square, diamond, triangle, cross };

/// Connection of consecutive points: none, straight lines, steps that keep y until the next x, or one line per pair of
/// points (0-1, 2-3, ...).
enum class PlotJoin { none, line, steps, pairs };

struct PlotSeries {
  std::string name;  ///< in the legend, which takes at most a third of the height; empty: no entry
  std::vector<PlotPoint> points;
  PlotMark mark = PlotMark::circle;
  PlotJoin join = PlotJoin::none;
  bool dashed = false;
  std::optional<std::uint32_t> color{};  ///< 0xrrggbb; unset: the next palette color, see Plot
};

/// Axes span the points with a margin; a linear axis starts at 0 if no value is negative and the least is below half of
/// the greatest. Series without a color take, in turn, those of Okabe and Ito (2008, "Color Universal Design") that are
/// legible on white, darkest first: they differ for every kind of color vision.
struct Plot {
  std::string title;
  PlotAxis x{}, y{};
  std::vector<PlotSeries> series{};         ///< later ones are drawn over earlier ones
  std::string note{};                       ///< below the axes, at most three lines or a third of the height
  std::uint32_t width = 960, height = 640;  ///< pixels; at least 320 x 240, at most 8192 x 8192
};

/// Self-contained SVG: shapes and text (DejaVu Sans, Verdana or the viewer's default), no script, no link; with a
/// title, a description for screen readers, and a tooltip at each mark.
std::string plot_svg(const Plot& plot);

/// The same drawing on white, 8 bits, `width` x `height` pixels. Text is drawn in DejaVu Sans or the closest installed
/// font. Fails with a sentence if there is no memory or Cairo fails.
Result<std::vector<std::uint8_t>, std::string> plot_png(const Plot& plot);

}  // namespace tracer
