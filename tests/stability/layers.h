#pragma once
/// Reflectance and transmittance of parallel layers of glass, in long double: the expected image of half-spaces.

#include <vector>

#include "tests/support/reference_optics.h"

namespace stability {

using oracle::Real;

/// Result for a ray at cos_i: the reflected part, the part transmitted through the last layer and the cosine there (0
/// and 0 at total reflection).
struct Layered {
  Real back = 1, onward = 0, cos_onward = 0;
};

/// `indices` start with the ray's medium, at least one. Inter-reflections between two interfaces form a geometric
/// series; an interface has the same reflectance from both sides (Stokes 1849).
inline Layered through_layers(Real cos_i, const std::vector<Real>& indices) {
  const Real sine = indices.front() * std::sqrt((1 - cos_i) * (1 + cos_i));
  const auto cosine = [sine](Real n) { return std::sqrt(std::fmax(0.0L, (n - sine) * (n + sine))) / n; };
  Layered below{0, 1, cosine(indices.back())};
  for (std::size_t i = indices.size() - 1; i-- > 0;) {
    const Real n1 = indices[i], n2 = indices[i + 1];
    const bool total = sine >= n2;
    const Real f = total ? 1 : n1 == n2 ? 0 : oracle::reflectance(i == 0 ? cos_i : cosine(n1), cosine(n2), n1, n2);
    const Real series = 1 - f * below.back;
    below = {total ? 1 : f + (1 - f) * (1 - f) * below.back / series, total ? 0 : (1 - f) * below.onward / series,
             below.cos_onward};
  }
  return below;
}

}  // namespace stability
