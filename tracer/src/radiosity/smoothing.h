#pragma once
/// Smoothing of the light of patches, whose noise is that of the finite number of rays in each row.

#include <array>
#include <cstdint>
#include <vector>

#include "tracer/src/math/vec.h"

namespace tracer {

/// By patch the patches beside it, in pairs on either side: along both axes and both diagonals; PatchGrid::none where
/// there is none.
using PatchNeighbors = std::vector<std::array<std::array<std::uint32_t, 2>, 4>>;

/// Makes the noise of two independent solutions smooth where the light is. Each patch takes the width of a filter at
/// which one filtered solution is closest to the other unfiltered one, in the mean over the patches around (Rousselle,
/// Knaus, Zwicker 2012, "Adaptive Rendering with Non-Local Means Filtering", sec. 5). Gradients stay as they are, since
/// only pairs count; so do borders. Throws std::bad_alloc.
void smooth(std::array<std::vector<Color>, 2>& solutions, const PatchNeighbors& beside);

}  // namespace tracer
