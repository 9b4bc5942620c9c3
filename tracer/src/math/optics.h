#pragma once
/// Reflection and dielectric interfaces. `d` is the unit direction of travel, `n` the unit normal on the ray's side
/// (d.n <= 0), and cos_i = |d.n|. Formulas: numerically stable forms of Whitted 1980 and Born & Wolf 1999, sec. 1.5.2.

#include <cmath>

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {

WHITTLE_INLINE Vec3 reflected(const Vec3& d, const Vec3& n) { return d - n * (2 * dot(d, n)); }

/// Fresnel terms of one interface, for a ray from index `n_from` to `n_to`.
struct Interface {
  bool total_internal_reflection = false;
  double cos_t = 0;        ///< cosine of the refracted angle; 0 at total internal reflection
  double reflectance = 1;  ///< unpolarized power reflectance F; the power transmitted is 1 - F
};

/// Exact unpolarized Fresnel reflectance for cos_i in [0,1] and indices > 0.
/// The numerators of the amplitudes are factored with (n-1)(n+1), n = n_to/n_from, s = sin_i:
///   r_s = -(n-1)(n+1) / (c + n c_t)^2,   r_p = (n-1)(n+1) (c^2 n^2 - s^2) / (n^2 c + n c_t)^2
/// so that nothing cancels as n -> 1 or n -> 0: with (n c_t)^2 = n^2 - s^2 these equal (c - n c_t)/(c + n c_t) and
/// (n c - c_t)/(n c + c_t) (Born & Wolf, eq. 1.5.21). n - 1 is (n_to - n_from)/n_from, exact when the two are close.
WHITTLE_INLINE Interface dielectric_interface(double cos_i, double n_from, double n_to) {
  const double n = n_to / n_from;
  const double excess = (n_to - n_from) / n_from * (n + 1);
  const double cos2_i = cos_i * cos_i, sin2_i = (1 - cos_i) * (1 + cos_i);
  // Equal expressions, but n^2 - s^2 cancels at grazing angles for n near 1, and the other at normal incidence for n
  // near 0.
  const double squared = cos2_i < 0.5 ? cos2_i + excess : n * n - sin2_i;
  const bool total = !(squared > 0);  // no branch, so that loops over lanes vectorize
  const double n_cos_t = std::sqrt(squared);
  const double s = cos_i + n_cos_t;
  const double p = n * n * cos_i + n_cos_t;
  const double r_s = -excess / (s * s);
  const double r_p = excess * (cos2_i * (n * n) - sin2_i) / (p * p);
  const double cos_t = n_cos_t / n, reflectance = 0.5 * (r_s * r_s + r_p * r_p);
  return {.total_internal_reflection = total,
          .cos_t = total ? 0 : (cos_t < 1 ? cos_t : 1),
          .reflectance = total ? 1 : (reflectance < 1 ? reflectance : 1)};
}

/// Snell's law in vector form: unit direction of the refracted ray. Precondition: no total internal reflection.
WHITTLE_INLINE Vec3 refracted(const Vec3& d, const Vec3& n, double cos_i, double cos_t, double n_from, double n_to) {
  const double eta = n_to / n_from;
  return unit((d + n * (cos_i - eta * cos_t)) / eta);
}

}  // namespace tracer
