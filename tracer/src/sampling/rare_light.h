#pragma once
/// Error of images of rare bright light, as far as the deviations of their pixels do not show it.

#include <cstddef>
#include <span>

#include "tracer/src/sampling/image_error.h"

namespace tracer {

/// Raises `variances`, those of whole rows from `first_row` on, where light is rare and bright, as a lamp that paths
/// find by chance in a mirror: most pixels then have no sample of it and hence no deviation, and it is cut off at white
/// in the others. Each cell of about a thousand pixels gets the mean squared distance of its pixels from the cell's
/// mean, as far as chance causes it. A cell without any sample of the light gets nothing. Returns the uncertainty that
/// this adds. Cells of which chance causes less than `chance_min` of the spread are left out.
SummedErrors add_rare_light(const UniformPixels& pixels, const DisplayTransform& display, std::size_t first_row,
                            std::span<float> variances, double chance_min = 0);

}  // namespace tracer
