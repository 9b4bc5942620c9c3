#pragma once
/// Drawing of a plot: a list of shapes in drawing order, in pixels from the upper left corner, for both writers.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tracer/plot.h"

namespace tracer::plotting {

using Color = std::uint32_t;  ///< 0xrrggbb

struct Place {
  double x = 0, y = 0;
};

/// Polylines of one style.
struct Stroke {
  std::vector<std::vector<Place>> lines;
  Color color = 0;
  double width = 1;
  bool dashed = false;
};

/// A filled mark with a white outline, so that overlapping marks stay distinguishable.
struct Marker {
  Place at;
  PlotMark mark = PlotMark::circle;
  Color color = 0;
  std::string hint{};  ///< tooltip; empty: none
};

enum class Anchor { start, middle, end };

/// One line of text with the base line at `at`. Valid UTF-8 without control characters.
struct Words {
  Place at;
  std::string text;
  double size = 13;  ///< font size, pixels
  Anchor anchor = Anchor::start;
  bool bold = false;
  bool upwards = false;  ///< rotated by 90 degrees, reads from bottom to top
  bool haloed = false;   ///< white outline, for text over lines
};

using Item = std::variant<Stroke, Marker, Words>;

struct Drawing {
  std::uint32_t width = 0, height = 0;
  std::string title, description;
  std::vector<Item> items;
};

inline constexpr std::string_view font_family = "DejaVu Sans";
inline constexpr Color ink = 0x222222;  ///< color of all text
inline constexpr double rim_width = 1;
inline constexpr double halo_width = 3;
inline constexpr double dash[] = {6, 4};

inline constexpr double circle_radius = 4.5;

// All marks have about the same weight: the areas are within a fifth of the circle's 64 pixels.
inline constexpr Place square[] = {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
inline constexpr Place diamond[] = {{0, -5.5}, {5.5, 0}, {0, 5.5}, {-5.5, 0}};
inline constexpr Place triangle[] = {{0, -6.2}, {5.7, 4.6}, {-5.7, 4.6}};
inline constexpr Place cross[] = {{-5.5, -3.2}, {-3.2, -5.5}, {0, -2.3}, {3.2, -5.5}, {5.5, -3.2}, {2.3, 0},
                                  {5.5, 3.2},   {3.2, 5.5},   {0, 2.3},  {-3.2, 5.5}, {-5.5, 3.2}, {-2.3, 0}};

/// Corners of a mark around (0,0); empty for circle and none.
constexpr std::span<const Place> corners(PlotMark mark) {
  constexpr std::span<const Place> shapes[] = {{}, {}, square, diamond, triangle, cross};
  return shapes[static_cast<std::size_t>(mark)];
}

/// Title and legend above the axes, the note below. Labels of ticks do not overlap, and no label of a point covers a
/// mark or another label.
Drawing layout(const Plot& plot);

}  // namespace tracer::plotting
