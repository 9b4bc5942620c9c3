#pragma once
/// From a plot to its drawing: what goes where.

#include "tracer/plot.h"
#include "tracer/src/plot/drawing.h"

namespace tracer::plotting {

/// Title and legend above the axes, the note below. No two labels of ticks overlap, and no label of a point covers a
/// mark or another label.
Drawing layout(const Plot& plot);

}  // namespace tracer::plotting
