#pragma once
/// Along which axis a ray goes most. Which one leads where two are equal decides nothing.

#include <cmath>

#include "tracer/src/math/wide.h"

namespace tracer {

WHITTLE_INLINE bool x_is_dominant(double dx, double dy, double dz) {
  return (std::abs(dx) >= std::abs(dy)) & (std::abs(dx) > std::abs(dz));
}
/// Precondition: x does not.
WHITTLE_INLINE bool y_leads(double dy, double dz) { return std::abs(dy) > std::abs(dz); }

}  // namespace tracer
