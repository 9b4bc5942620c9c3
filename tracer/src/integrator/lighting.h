#pragma once
/// Wavefront, the local model: what the surface itself gives, and what lights give it.

#include <limits>

#include "tracer/src/integrator/wavefront.h"
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
  face_lights(rays);
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

/// The places that the hits are lit at, each once for all lights.
template <class Model>
void Wavefront<Model>::face_lights(const RayQueue& rays) {
  facings_.clear();
  for (std::size_t hit = 0; hit < hit_ray_.size(); ++hit) {
    if (needs<&Requirements::gouraud>() && face_at_corners(rays, hit)) continue;
    const Surface& surface = surface_[hit];
    const BoundedPoint point{surface.point.position + surface.shadow_offset, surface.point.error};
    face(hit, point, surface.normal, -rays.direction(hit_ray_[hit]), 1);
  }
}

/// One place of a hit, which has a `share` of its light.
template <class Model>
void Wavefront<Model>::face(std::size_t hit, const BoundedPoint& point, const Vec3& normal, const Vec3& to_eye,
                            double share) {
  const Surface& surface = surface_[hit];
  const Material& material = scene_.materials[surface.material];
  const bool shines = material.model != Material::Model::lambert && material.specular > 0;
  facings_.push({.point = point,
                 .face = surface.geometric_normal,
                 .normal = normal,
                 .to_eye = to_eye,
                 .diffuse = weight_[hit] * color_[hit] * (material.diffuse * body(material) * share),
                 .specular = shines ? weight_[hit] * material.specular_color * (material.specular * share) : Color{},
                 .shininess = material.shininess,
                 .halfway = material.model == Material::Model::blinn_phong,
                 .hit = static_cast<std::uint32_t>(hit)});
}

/// Gouraud's: the local model at a triangle's corners. False: this hit is none of that.
template <class Model>
bool Wavefront<Model>::face_at_corners(const RayQueue& rays, std::size_t hit) {
  const Surface& surface = surface_[hit];
  const Material& material = scene_.materials[surface.material];
  if (shading_of(material, approximate().shading) != Material::Shading::gouraud) return false;
  const std::uint32_t ray = hit_ray_[hit];
  const std::optional<Corners> corners = corners_at(scene_, hits_.at(ray));
  if (!corners) return false;
  if (needs<&Requirements::bump>()) unbent_[hit] = {};  // textures do not bend the corners' normals
  for (const Corner& corner : *corners) {
    const Vec3 to_eye = normalize(rays.origin(ray) - corner.point.position);
    face(hit, corner.point, surface.back ? -corner.normal : corner.normal, to_eye, corner.weight);
  }
  return true;
}

/// The samples of a pixel share one sequence per light and path, so that their points are stratified together;
/// shuffled, since the same index chose the place in the pixel.
template <class Model>
Vec3 Wavefront<Model>::soft_point_of(const LightStep& step, const RayQueue& rays, std::size_t ray) const {
  const Batch::Sample& sample = samples_[rays.sample(ray)];
  const std::uint64_t choice = (std::uint64_t{rays.path(ray)} << 32) | (step.number + 1);
  return light_point(step.light,
                     shuffled_point(sample.index * step.points + step.point, mix(sample.key ^ mix(choice))));
}

/// Where the light is to the places of a packet. One that is not soft is where it was to the packet before.
template <class Model>
void Wavefront<Model>::place_light(const LightStep& step, const RayQueue& rays, const FacingPacket* packet) {
  for (int lane = 0; lane < (packet != nullptr ? packet->count : lanes); ++lane) {
    const Vec3 from = packet != nullptr ? soft_point_of(step, rays, hit_ray_[packet->hit[lane]]) : step.light.position;
    arrival_.from_x[lane] = from.x;
    arrival_.from_y[lane] = from.y;
    arrival_.from_z[lane] = from.z;
  }
}

template <class Model>
void Wavefront<Model>::shade_light(const RayQueue& rays, const LightStep& step, Coherence coherence) {
  shadow_.clear();
  // Together: a place in a scene without any of them pays one test.
  const bool sorts_out =
      !step.light.shadows || may_spare_shadows() || approximate().nearest_lights != 0 || needs<&Requirements::bump>();
  if (!step.light.soft()) place_light(step, rays, nullptr);
  for (std::size_t i = 0; i < facings_.packets(); ++i) {
    const FacingPacket& packet = facings_.packet(i);
    if (step.light.soft()) place_light(step, rays, &packet);
    arrive(packet, step.light, scene_.frame.world_from_trace(1.0), 1.0 / step.points, arrival_);
    for (int arrived = 0; arrived < arrival_.count; ++arrived) {
      const int lane = arrival_.lane[arrived];
      if (sorts_out && !asks_for_shadow(rays, step, packet, lane)) continue;
      const std::uint32_t ray = hit_ray_[packet.hit[lane]];
      shadow_.push(arrival_.origin(lane), arrival_.to_light(lane), arrival_.distance[lane], arrival_.color(lane),
                   rays.sample(ray), hits_.primitive[ray], rays.media(ray));
    }
  }
  statistics_.rays.shadow += shadow_.size();
  shadow_.add_to(radiance_, media_, coherence);
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
bool Wavefront<Model>::seems_lit(const LightStep& step, const FacingPacket& packet, int lane, const Vec3& to_light,
                                 const Vec3& origin) const {
  if (approximate().shadows == Approximations::Shadows::none) return true;
  const std::size_t hit = packet.hit[lane];
  const Vec3 place{packet.x[lane], packet.y[lane], packet.z[lane]};
  if (!scene_.shadow_maps[step.number].lit(place, surface_[hit].geometric_normal)) return false;
  const double short_of_it = arrival_.distance[lane] * (1 - 0x1p-40);  // as shadow rays are
  return !plane_between(scene_.geometry(), origin, to_light, short_of_it, hits_.primitive[hit_ray_[hit]]);
}

/// Whether a shadow ray must tell what a place gains of the light that would arrive. False: it gains all of it, where
/// the light casts no shadows or an approximation says so, or nothing: of lights that do not count, of too little
/// light, of light from behind the surface that a bent normal faces. Out of line, for scenes without any of these.
template <class Model>
__attribute__((noinline)) bool Wavefront<Model>::asks_for_shadow(const RayQueue& rays, const LightStep& step,
                                                                 const FacingPacket& packet, int lane) {
  const std::size_t hit = packet.hit[lane];
  const Vec3 to_light = arrival_.to_light(lane);
  if (approximate().nearest_lights != 0 && !nearest_.count(hit, step.number)) return false;
  if (needs<&Requirements::bump>() && dot(unbent_[hit], to_light) < 0) return false;
  const bool exact = approximate().shadows == Approximations::Shadows::exact;
  if (step.light.shadows && exact) return !may_spare_shadows() || !spares(rays, hit, step, arrival_.color(lane));
  if (!step.light.shadows || seems_lit(step, packet, lane, to_light, arrival_.origin(lane)))
    radiance_[rays.sample(hit_ray_[hit])] += arrival_.color(lane);
  return false;
}

}  // namespace tracer
