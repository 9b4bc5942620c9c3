#pragma once
/// What a plot looks like, in pixels from the upper left corner: plain shapes that both writers draw in their order.

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

/// Lines of one look, each through its places.
struct Stroke {
  std::vector<std::vector<Place>> lines;
  Color color = 0;
  double width = 1;
  bool dashed = false;
};

/// A filled mark with a white rim, so that marks which overlap can be counted.
struct Marker {
  Place at;
  PlotMark mark = PlotMark::circle;
  Color color = 0;
  std::string hint{};  ///< tooltip; empty: none
};

enum class Anchor { start, middle, end };

/// One line of text; `at` is on its base line. Valid UTF-8 without control characters.
struct Words {
  Place at;
  std::string text;
  double size = 13;  ///< of the font, pixels
  Anchor anchor = Anchor::start;
  bool bold = false;
  bool upwards = false;  ///< turned by a quarter, to be read from the bottom to the top
  bool haloed = false;   ///< with a white rim: over lines
};

using Item = std::variant<Stroke, Marker, Words>;

struct Drawing {
  std::uint32_t width = 0, height = 0;
  std::string title, description;
  std::vector<Item> items;
};

inline constexpr std::string_view font_family = "DejaVu Sans";
inline constexpr Color ink = 0x222222;  ///< of all text
inline constexpr double rim_width = 1;
inline constexpr double halo_width = 3;
inline constexpr double dash[] = {6, 4};

inline constexpr double circle_radius = 4.5;
/// The corners of a mark around (0,0); a circle, and none, have none.
std::span<const Place> corners(PlotMark mark);

}  // namespace tracer::plotting
