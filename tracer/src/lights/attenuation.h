#pragma once
/// How a light fades with distance.

#include <array>
#include <limits>

#include "tracer/scene.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// f(d), d >= 0 in scene units (Foley, van Dam, Feiner, Hughes 1990, eq. 16.8 for the capped polynomial).
WHITTLE_INLINE double polynomial_attenuation(const std::array<double, 3>& c, double d) {
  const double f = 1 / (c[0] + (c[1] + c[2] * d) * d);
  return 1 < f ? 1 : f;
}
WHITTLE_INLINE double inverse_square_attenuation(double d) { return 1 / (d * d); }

/// The least upper bound of f over all distances that does not look at the coefficients.
inline double attenuation_bound(const Attenuation& attenuation) {
  return attenuation.kind == Attenuation::Kind::inverse_square ? std::numeric_limits<double>::infinity() : 1;
}

}  // namespace tracer
