#pragma once
/// The specular factors of the local illumination models.

#include <algorithm>
#include <cmath>

#include "tracer/src/math/vec.h"

namespace tracer {

/// c^n for c clamped to [0,1] and n >= 0, with 0^0 = 1. std::pow is right to its last bit for every exponent: what it
/// is given, c, has all its digits; exp(n log1p(c-1)) would lose those of a small one.
inline double highlight(double c, double n) { return std::pow(std::clamp(c, 0.0, 1.0), n); }

/// spec of the material's model at unit normal n, unit directions l to the light and v to the eye; 0 where n.l <= 0.
/// phong: max(0, r.v)^n with r = 2(n.l)n - l (Phong 1975). blinn_phong: max(0, n.h)^n with h = (l+v)/|l+v| (Blinn
/// 1977).
inline double specular_factor(Material::Model model, double shininess, const Vec3& n, const Vec3& l, const Vec3& v) {
  const double n_dot_l = dot(n, l);
  if (model == Material::Model::lambert || n_dot_l <= 0) return 0;
  if (model == Material::Model::phong) {
    const Vec3 r = n * (2 * n_dot_l) - l;
    return highlight(dot(r, v), shininess);
  }
  const Vec3 h = l + v;
  const double h_length = length(h);
  return h_length > 0 ? highlight(dot(n, h) / h_length, shininess) : 0;
}

}  // namespace tracer
