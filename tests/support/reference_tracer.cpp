#include "tests/support/reference_tracer.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <variant>

namespace oracle {
namespace {

constexpr Real pi = std::numbers::pi_v<Real>;
constexpr Real infinity = std::numeric_limits<Real>::infinity();

Real fade(const tracer::Attenuation& attenuation, Real d) {
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

Real power(Real cosine, Real exponent) {
  if (exponent == 0) return 1;
  return cosine <= 0 ? 0 : std::pow(std::fmin(cosine, 1.0L), exponent);
}

Real highlight(const tracer::Material& material, const Vec& n, const Vec& l, const Vec& v) {
  switch (material.model) {
    case tracer::Material::Model::lambert:
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

/// Fresnel's amplitudes as Born & Wolf print them (eq. 1.5.21), squared and averaged.
Real reflectance(Real cos_i, Real cos_t, Real n_from, Real n_to) {
  const Real s = (n_from * cos_i - n_to * cos_t) / (n_from * cos_i + n_to * cos_t);
  const Real p = (n_to * cos_i - n_from * cos_t) / (n_to * cos_i + n_from * cos_t);
  return (s * s + p * p) / 2;
}

}  // namespace

Sample ReferenceTracer::sample(Real x, Real y, tracer::RenderStatistics& counted) const {
  const Real width = scene_.image.width, height = scene_.image.height;
  const Vec through = forward_ + ((2 * x - width) / height) * right_ + ((height - 2 * y) / height) * up_;
  Path path{counted};
  ++counted.samples;
  ++counted.rays.camera;
  const Ray ray{scene_.camera.position, unit(through)};
  const Light3 radiance = trace(ray, {1, 1, 1}, 0, path);
  return {radiance, path.margin};
}

std::vector<Sample> ReferenceTracer::picture(tracer::RenderStatistics& counted) const {
  std::vector<Sample> pixels;
  for (std::uint32_t y = 0; y < scene_.image.height; ++y)
    for (std::uint32_t x = 0; x < scene_.image.width; ++x) pixels.push_back(sample(x + 0.5L, y + 0.5L, counted));
  return pixels;
}

Light3 ReferenceTracer::trace(const Ray& ray, const Light3& weight, std::uint32_t depth, Path& path) const {
  const Hit hit = nearest(ray, path);
  if (hit.body == nullptr) return scene_.background.color;
  const Point point = point_at(ray, hit);
  return local(point, -ray.direction, weight, path) + bounced(ray, point, weight, depth, path);
}

Light3 ReferenceTracer::local(const Point& point, const Vec& to_eye, const Light3& weight, Path& path) const {
  const tracer::Material& material = *point.hit.body->material;
  const Light3 color = surface_color(point, path);
  Light3 sum = Light3(material.emission) + material.ambient * (color * Light3(scene_.ambient));
  for (const tracer::Light& light : scene_.lights) {
    Vec to_light;
    Real distance = infinity, f = 1;
    if (const auto* directional = std::get_if<tracer::DirectionalLight>(&light.source)) {
      to_light = -unit(directional->direction);
    } else {
      const Vec offset = Vec(std::get<tracer::PointLight>(light.source).position) - point.position;
      distance = length(offset);
      to_light = unit(offset);
      f = fade(light.attenuation, distance);
    }
    const Real n_l = dot(point.normal, to_light);
    if (material.specular > 0) path.near_miss(n_l);  // the highlight ends there at once
    if (n_l <= 0) continue;
    const Light3 reflected =
        (material.diffuse * n_l) * color +
        (material.specular * highlight(material, point.normal, to_light, to_eye)) * Light3(material.specular_color);
    const Light3 unshadowed = (f * light.intensity) * (Light3(light.color) * reflected);
    if (largest(weight * unshadowed) == 0) continue;
    sum = sum + (light.shadows ? unshadowed * visible(point, to_light, distance, path) : unshadowed);
  }
  return sum;
}

/// S: the product over every surface on the way.
Light3 ReferenceTracer::visible(const Point& point, const Vec& to_light, Real distance, Path& path) const {
  ++path.counted.rays.shadow;
  Light3 through{1, 1, 1};
  Ray ray{point.position, to_light, point.hit.body, point.hit.face, distance};
  for (Hit hit = nearest(ray, path); hit.body != nullptr; hit = nearest(ray, path)) {
    const tracer::Material& material = *hit.body->material;
    if (material.transmission == 0) return {};
    through = material.transmission * (through * Light3(material.transmission_color));
    ray = {ray.origin + hit.t * to_light, to_light, hit.body, hit.face, ray.end - hit.t};
  }
  return through;
}

Light3 ReferenceTracer::bounced(const Ray& ray, const Point& point, const Light3& weight, std::uint32_t depth,
                                Path& path) const {
  const tracer::Material& material = *point.hit.body->material;
  if (material.reflection == 0 && material.transmission == 0) return {};
  const Vec d = ray.direction;
  const Vec n = dot(d, point.normal) < 0 ? point.normal : point.face_normal;
  const Real cos_i = -dot(d, n);
  const bool leaving = point.back && material.transmission > 0;
  const Real n_from = leaving ? material.ior : 1, n_to = leaving ? 1 : material.ior;
  // Snell's law by the part of d along the surface: sin_t / sin_i = n_from / n_to.
  const Vec along = (n_from / n_to) * (d + cos_i * n);
  const Real cos2_t = 1 - dot(along, along);
  const bool total = cos2_t <= 0;
  const Real cos_t = total ? 0 : std::sqrt(cos2_t);
  Light3 mirror = material.reflection * Light3(material.reflection_color);
  Light3 transmit = material.transmission * Light3(material.transmission_color);
  if (material.transmission > 0 || material.fresnel) path.near_miss(cos2_t / std::fmax(1.0L, n_from / n_to));
  if (material.fresnel) {
    const Real f = total ? 1 : reflectance(cos_i, cos_t, n_from, n_to);
    mirror = f * mirror;
    transmit = (1 - f) * transmit;
  } else if (total) {
    mirror = mirror + transmit;
  }
  if (total) transmit = {};
  Vec mirrored = unit(d + 2 * cos_i * n);
  const Real off_face = dot(mirrored, point.face_normal);
  if (off_face < 0) mirrored = unit(mirrored - 2 * off_face * point.face_normal);
  return follow(point, unit(along - cos_t * n), weight, transmit, depth, path.counted.rays.refraction, path) +
         follow(point, mirrored, weight, mirror, depth, path.counted.rays.reflection, path);
}

Light3 ReferenceTracer::follow(const Point& point, const Vec& direction, const Light3& weight, const Light3& factor,
                               std::uint32_t depth, std::uint64_t& kind, Path& path) const {
  if (largest(factor) == 0) return {};
  const Light3 arriving = weight * factor;
  if (scene_.accuracy.cutoff > 0) path.near_miss(largest(arriving) / scene_.accuracy.cutoff - 1);
  if (largest(arriving) < scene_.accuracy.cutoff || largest(arriving) == 0) {
    ++path.counted.cut_branches;
    return {};
  }
  if (depth >= scene_.accuracy.max_depth) {
    ++path.counted.truncated_branches;
    return {};
  }
  ++kind;
  const Ray ray{point.position, direction, point.hit.body, point.hit.face};
  return factor * trace(ray, arriving, depth + 1, path);
}

}  // namespace oracle
