#pragma once
/// Optics and surfaces of the reference tracer, in long double.

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/long_vec.h"

namespace oracle {

inline Real fade(const tracer::Attenuation& attenuation, Real d) {
  const auto& c = attenuation.coefficients;
  switch (attenuation.kind) {
    case tracer::Attenuation::Kind::none:
      return 1;
    case tracer::Attenuation::Kind::polynomial:
      return std::fmin(1 / (c[0] + c[1] * d + c[2] * d * d), 1.0L);
    case tracer::Attenuation::Kind::inverse_square:
      return 1 / (d * d);
  }
  return 1;
}

inline Real power(Real cosine, Real exponent) {
  if (exponent == 0) return 1;
  const Real power = cosine <= 0 ? 0 : std::pow(std::fmin(cosine, 1.0L), exponent);
  return power < 0x1p-1022L ? 0 : power;  // black for a tracer in double: it has no shadow ray
}

inline Real highlight(const tracer::Material& material, const Vec& n, const Vec& l, const Vec& v) {
  switch (material.model) {
    case tracer::Material::Model::lambert:
    case tracer::Material::Model::principled:
      return 0;
    case tracer::Material::Model::phong:
      return power(dot(2 * dot(n, l) * n - l, v), material.shininess);
    case tracer::Material::Model::blinn_phong: {
      const Vec h = l + v;
      return length(h) > 0 ? power(dot(n, h) / length(h), material.shininess) : 0;
    }
  }
  return 0;
}

/// Light from l behind the surface, where n.l < 0, bent by Snell's law; eta is the index of refraction there over that
/// in front. The part of a direction along the surface is the sine of its angle.
inline Real transmitted_highlight(const tracer::Material& material, const Vec& n, const Vec& l, const Vec& v,
                                  Real eta) {
  const Vec along = eta * (dot(l, n) * n - l);
  const Real cos2 = 1 - dot(along, along);
  if (cos2 <= 0 || material.model == tracer::Material::Model::lambert) return 0;
  const Real exponent = material.shininess / (material.model == tracer::Material::Model::blinn_phong ? 4 : 1);
  return power(dot(along + std::sqrt(cos2) * n, v), exponent);
}

/// Fresnel's amplitudes as Born & Wolf print them (eq. 1.5.21), squared and averaged.
inline Real reflectance(Real cos_i, Real cos_t, Real n_from, Real n_to) {
  const Real s = (n_from * cos_i - n_to * cos_t) / (n_from * cos_i + n_to * cos_t);
  const Real p = (n_to * cos_i - n_from * cos_t) / (n_to * cos_i + n_from * cos_t);
  return (s * s + p * p) / 2;
}

/// The two axes perpendicular to `n`: e0 is `first` without its part along n, or z if that vanishes.
inline std::pair<Vec, Vec> axes(const Vec& n, const Vec& first) {
  Vec e0 = first - dot(first, n) * n;
  if (length(e0) < 1e-13L * length(first)) e0 = Vec(0, 0, 1) - n.z * n;
  e0 = unit(e0);
  return {e0, cross(n, e0)};
}

/// True if each edge has as many faces in one direction as in the other.
template <class Face>
bool is_closed(const std::vector<Face>& faces) {
  using Corner = std::tuple<Real, Real, Real>;
  std::map<std::pair<Corner, Corner>, int> directed;
  for (const Face& face : faces) {
    const Vec corners[] = {face.a, face.b, face.c};
    for (int i = 0; i < 3; ++i) {
      const Vec &p = corners[i], &q = corners[(i + 1) % 3];
      ++directed[{{p.x, p.y, p.z}, {q.x, q.y, q.z}}];
      --directed[{{q.x, q.y, q.z}, {p.x, p.y, p.z}}];
    }
  }
  return std::all_of(directed.begin(), directed.end(), [](const auto& edge) { return edge.second == 0; });
}

/// True if a ray that enters the surface is in a medium of this material. Light passes straight through materials
/// without refraction, which have a medium only where a solid absorbs.
inline bool has_medium(const tracer::Material& material, bool closed) {
  const bool refracts = material.transparency == tracer::Material::Transparency::refract;
  const bool absorbs = !(material.absorption == tracer::Color{});
  if (material.transmission == 0) return false;
  return closed ? refracts || absorbs : refracts && (absorbs || material.ior != 1);
}

}  // namespace oracle
