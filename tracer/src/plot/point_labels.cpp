#include "tracer/src/plot/point_labels.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tracer/src/plot/text.h"

namespace tracer::plotting {
namespace {

constexpr double size = 12, aside = 4, mark_reach = 6;
constexpr double ascent = 0.8 * size, descent = 0.25 * size;
constexpr double above = -mark_reach - descent - 1, below = mark_reach + ascent + 1;

bool overlap(const Box& a, const Box& b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

bool within(const Box& inner, const Box& outer) {
  return inner.left >= outer.left && inner.right <= outer.right && inner.top >= outer.top &&
         inner.bottom <= outer.bottom;
}

struct Try {
  Place offset;
  Anchor anchor;
};
// Diagonal positions only: lines often leave horizontally or vertically.
constexpr std::array<Try, 4> tries{{{{aside, above}, Anchor::start},
                                    {{-aside, below}, Anchor::end},
                                    {{aside, below}, Anchor::start},
                                    {{-aside, above}, Anchor::end}}};

Box box_of(const Words& words) {
  const double width = text_width(words.text, size);
  const double start = words.anchor == Anchor::start ? 0 : -width;
  const double left = words.at.x + start;
  return {left, words.at.y - ascent, left + width, words.at.y + descent};
}

}  // namespace

std::vector<Words> point_labels(const std::vector<PointToLabel>& points, const Box& inside) {
  std::vector<Box> taken;
  for (const PointToLabel& point : points) {
    const auto& [x, y] = point.at;
    if (point.marked) taken.push_back({x - mark_reach, y - mark_reach, x + mark_reach, y + mark_reach});
  }
  std::vector<Words> placed;
  for (const PointToLabel& point : points) {
    if (point.label.empty()) continue;
    for (const Try& attempt : tries) {
      const Place at{point.at.x + attempt.offset.x, point.at.y + attempt.offset.y};
      Words words{.at = at, .text = point.label, .size = size, .anchor = attempt.anchor, .haloed = true};
      const Box box = box_of(words);
      const bool free = within(box, inside) &&
                        std::none_of(taken.begin(), taken.end(), [&](const Box& other) { return overlap(box, other); });
      if (!free) continue;
      taken.push_back(box);
      placed.push_back(std::move(words));
      break;
    }
  }
  return placed;
}

}  // namespace tracer::plotting
