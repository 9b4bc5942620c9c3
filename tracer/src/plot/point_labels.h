#pragma once
/// Placement of the labels of points.

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
  std::string label{};  ///< empty: none
};

/// Greedy placement in order: above and right of the point, else in one of the three other corners, within `inside`. A
/// label that would cover a mark or an earlier label in all four is omitted.
std::vector<Words> point_labels(const std::vector<PointToLabel>& points, const Box& inside);

}  // namespace tracer::plotting
