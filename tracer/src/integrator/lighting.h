#pragma once
/// Wavefront, the local model: what the surface itself gives, and what lights give it.

#include <limits>

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/lights/attenuation.h"
#include "tracer/src/materials/local_model.h"
#include "tracer/src/materials/shading.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/shapes/uv_gradients.h"
#include "tracer/src/textures/texture.h"

namespace tracer {

/// What is left of the ambient and diffuse light of a surface that interpolates it with what is behind.
inline double body(const Material& material) {
  return material.transparency == Material::Transparency::interpolated ? 1 - material.transmission : 1;
}

template <class Model>
void Wavefront<Model>::shade_own_light(const RayQueue& rays) {
  color_.clear();
  for (std::size_t i = 0; i < hit_ray_.size(); ++i) {
    const Material& material = scene_.materials[surface_[i].material];
    color_.push_back(color_at(rays, i));
    const Color own = material.emission + scene_.ambient * color_.back() * (material.ambient * body(material));
    radiance_[rays.sample(hit_ray_[i])] += weight_[i] * own;
  }
}

template <class Model>
Color Wavefront<Model>::color_at(const RayQueue& rays, std::size_t hit) const {
  const Surface& surface = surface_[hit];
  const ColorOrTexture& color = scene_.materials[surface.material].color;
  const auto* id = std::get_if<TextureId>(&color);
  if (id == nullptr) return std::get<Color>(color);
  const auto [texture, image] = texture_of(*id);
  return texture_color(texture, surface.uv, covered_of(rays, hit, texture), image);
}

template <class Model>
typename Wavefront<Model>::TextureOf Wavefront<Model>::texture_of(TextureId id) const {
  return {scene_.textures[id.index], scene_.images[id.index].get()};
}

/// Nothing of a texture that is not filtered.
template <class Model>
Vec2 Wavefront<Model>::covered_of(const RayQueue& rays, std::size_t hit, const Texture& texture) const {
  if (texture.filter != Texture::Filter::mipmap) return {};
  const Surface& surface = surface_[hit];
  const std::uint32_t ray = hit_ray_[hit];
  return covered_uv(uv_gradients_at(scene_, hits_.at(ray), surface), surface.geometric_normal, rays.direction(ray),
                    rays.cone(ray).width_at(hits_.t[ray]));
}

/// A soft light is known to what camera rays hit by the batch's number of points; after a bounce, by one.
template <class Model>
void Wavefront<Model>::shade_lights(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
  const std::uint32_t soft_points = depth == 0 ? light_points_ : 1;
  const double spare =
      needs<&Requirements::many_lights>() ? scene_.accuracy.cutoff / static_cast<double>(scene_.lights.size()) : 0;
  spared_.assign(needs<&Requirements::many_lights>() ? hit_ray_.size() : 0, 0);
  const std::uint32_t nearest = approximate().nearest_lights;
  if (nearest != 0) nearest_.choose(scene_.lights, surface_, nearest);
  for (std::uint32_t number = 0; number < scene_.lights.size(); ++number) {
    const TraceLight& light = scene_.lights[number];
    const std::uint32_t points = light.soft() ? soft_points : 1;
    for (std::uint32_t point = 0; point < points; ++point) {
      if (control_.cancelled()) return;
      const double so_far = number + (point + 1.0) / points;
      shade_light(rays, {light, number, point, points, spare * so_far}, coherence);
    }
  }
  for (const double spared : spared_)
    statistics_.spared_light += static_cast<std::uint64_t>(std::ceil(spared / scene_.accuracy.cutoff * 0x1p20));
}

/// The samples of a pixel share one sequence per light and path, so that their points are stratified together;
/// shuffled, since the same index chose the place in the pixel.
template <class Model>
Vec3 Wavefront<Model>::point_of(const LightStep& step, const RayQueue& rays, std::size_t ray) const {
  if (!step.light.soft()) return step.light.position;
  const Batch::Sample& sample = samples_[rays.sample(ray)];
  const std::uint64_t choice = (std::uint64_t{rays.path(ray)} << 32) | (step.number + 1);
  return light_point(step.light,
                     shuffled_point(sample.index * step.points + step.point, mix(sample.key ^ mix(choice))));
}

template <class Model>
void Wavefront<Model>::shade_light(const RayQueue& rays, const LightStep& step, Coherence coherence) {
  shadow_.clear();
  // Together: a hit in a scene without any of them pays one test.
  const bool singles_out =
      approximate().nearest_lights != 0 || needs<&Requirements::gouraud>() || needs<&Requirements::bump>();
  for (std::size_t i = 0; i < hit_ray_.size(); ++i) {
    if (singles_out && shade_singly(rays, step, i)) continue;
    const Surface& surface = surface_[i];
    const BoundedPoint point{surface.point.position + surface.shadow_offset, surface.point.error};
    shade_facing(rays, step, i, {point, surface.normal, -rays.direction(hit_ray_[i])});
  }
  statistics_.rays.shadow += shadow_.size();
  shadow_.add_to(radiance_, media_, coherence);
}

/// Hits that are not lit by every light, at one place, by one normal. False: this one is. Out of line, for the others.
template <class Model>
__attribute__((noinline)) bool Wavefront<Model>::shade_singly(const RayQueue& rays, const LightStep& step,
                                                              std::size_t hit) {
  if (approximate().nearest_lights != 0 && !nearest_.count(hit, step.number)) return true;
  if (needs<&Requirements::gouraud>() && shade_corners(rays, step, hit)) return true;
  if (unbent_.empty()) return false;
  const Surface& surface = surface_[hit];
  const BoundedPoint point{surface.point.position + surface.shadow_offset, surface.point.error};
  shade_facing(rays, step, hit, {point, surface.normal, -rays.direction(hit_ray_[hit]), 1, &unbent_[hit]});
  return true;
}

/// Gouraud's: the local model at a triangle's corners. False: this hit is none of that.
template <class Model>
bool Wavefront<Model>::shade_corners(const RayQueue& rays, const LightStep& step, std::size_t hit) {
  const Surface& surface = surface_[hit];
  const Material& material = scene_.materials[surface.material];
  if (shading_of(material, approximate().shading) != Material::Shading::gouraud) return false;
  const std::uint32_t ray = hit_ray_[hit];
  const std::optional<Corners> corners = corners_at(scene_, hits_.at(ray));
  if (!corners) return false;
  for (const Corner& corner : *corners) {
    const Vec3 to_eye = normalize(rays.origin(ray) - corner.point.position);
    shade_facing(rays, step, hit, {corner.point, surface.back ? -corner.normal : corner.normal, to_eye, corner.weight});
  }
  return true;
}

/// Whether what the light gives, if nothing is in the way, is too little to ask. Lights share what may be missing of a
/// hit, `cutoff`: each may leave out its own share and what those before it have not used.
template <class Model>
bool Wavefront<Model>::spares(const RayQueue& rays, std::size_t hit, const LightStep& step, const Color& contribution) {
  const double spared = spared_[hit] + max_component(contribution);
  if (!(spared <= step.spare)) return false;
  ++statistics_.spared_shadow_rays;
  missing_[rays.sample(hit_ray_[hit])].spared += static_cast<float>(max_component(contribution));
  spared_[hit] = spared;
  return true;
}

/// By approximation: without shadows everything is; a map knows what is finite, and planes are asked themselves.
template <class Model>
bool Wavefront<Model>::seems_lit(const LightStep& step, std::size_t hit, const Facing& facing, const Vec3& to_light,
                                 double distance) const {
  if (approximate().shadows == Approximations::Shadows::none) return true;
  const Vec3& normal = surface_[hit].geometric_normal;
  if (!scene_.shadow_maps[step.number].lit(facing.point.position, normal)) return false;
  const double short_of_it = distance * (1 - 0x1p-40);  // as shadow rays are
  return !plane_between(scene_.geometry(), offset_origin(facing.point, normal, to_light), to_light, short_of_it,
                        hits_.primitive[hit_ray_[hit]]);
}

template <class Model>
void Wavefront<Model>::shade_facing(const RayQueue& rays, const LightStep& step, std::size_t hit,
                                    const Facing& facing) {
  const TraceLight& light = step.light;
  const Surface& surface = surface_[hit];
  const Material& material = scene_.materials[surface.material];
  const std::uint32_t ray = hit_ray_[hit];
  Vec3 to_light = light.axis;
  double distance = std::numeric_limits<double>::infinity();
  double strength = facing.share / step.points;
  if (light.kind != TraceLight::Kind::directional) {
    const Vec3 offset = point_of(step, rays, ray) - facing.point.position;
    distance = length(offset);
    if (!(distance > 0)) return;  // the light touches the surface: no direction to shine from
    to_light = offset / distance;
    strength *=
        attenuation_at(light.attenuation, scene_.frame.world_from_trace(distance)) * spot_factor(light, -to_light);
  }
  const double n_dot_l = dot(facing.normal, to_light);
  if (!(n_dot_l > 0) || (facing.unbent != nullptr && dot(*facing.unbent, to_light) < 0)) return;
  const double spec = material.specular > 0
                          ? specular_factor(material.model, material.shininess, facing.normal, to_light, facing.to_eye)
                          : 0;
  const Color reflected_light = color_[hit] * (material.diffuse * body(material) * n_dot_l) +
                                material.specular_color * (material.specular * spec);
  const Color contribution = weight_[hit] * light.radiance * reflected_light * strength;
  if (is_black(contribution)) return;
  if (!light.shadows) {
    radiance_[rays.sample(ray)] += contribution;
    return;
  }
  if (may_spare_shadows()) {
    if (approximate().shadows != Approximations::Shadows::exact) {
      if (seems_lit(step, hit, facing, to_light, distance)) radiance_[rays.sample(ray)] += contribution;
      return;
    }
    if (spares(rays, hit, step, contribution)) return;
  }
  shadow_.push(offset_origin(facing.point, surface.geometric_normal, to_light), to_light, distance, contribution,
               rays.sample(ray), hits_.primitive[ray], rays.media(ray));
}

}  // namespace tracer
