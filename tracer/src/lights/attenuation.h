#pragma once
/// How a light fades with distance.

#include <algorithm>
#include <limits>

#include "tracer/scene.h"

namespace tracer {

/// f(d), d >= 0 in scene units (Foley, van Dam, Feiner, Hughes 1990, eq. 16.8 for the capped polynomial).
inline double attenuation_at(const Attenuation& attenuation, double d) {
  switch (attenuation.kind) {
    case Attenuation::Kind::none:
      return 1;
    case Attenuation::Kind::polynomial: {
      const auto& c = attenuation.coefficients;
      return std::min(1 / (c[0] + (c[1] + c[2] * d) * d), 1.0);
    }
    case Attenuation::Kind::inverse_square:
      return 1 / (d * d);
  }
  return 1;
}

/// The least upper bound of f over all distances that does not look at the coefficients.
inline double attenuation_bound(const Attenuation& attenuation) {
  return attenuation.kind == Attenuation::Kind::inverse_square ? std::numeric_limits<double>::infinity() : 1;
}

}  // namespace tracer
