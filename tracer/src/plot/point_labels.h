#pragma once
/// Labels beside points, where there is room for them.

#include <string>
#include <vector>

#include "tracer/src/plot/drawing.h"

namespace tracer::plotting {

struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
};

struct PointToLabel {
  Place at;
  bool marked = true;   ///< no label may cover it
  std::string label{};  ///< empty: wants none
};

/// First come, first served: above and right of the point, else in one of the three other corners, within `inside`. A
/// label that would cover a mark or an earlier label in all four is left out.
std::vector<Words> point_labels(const std::vector<PointToLabel>& points, const Box& inside);

}  // namespace tracer::plotting
