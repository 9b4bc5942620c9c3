#pragma once
/// Layout: converts a plot to a drawing.

#include "tracer/plot.h"
#include "tracer/src/plot/drawing.h"

namespace tracer::plotting {

/// Title and legend above the axes, the note below. Labels of ticks do not overlap, and no label of a point covers a
/// mark or another label.
Drawing layout(const Plot& plot);

}  // namespace tracer::plotting
