#pragma once
/// Wavefront, the local model: what lights give the places that hits are lit at.

#include <limits>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

/// A soft light is known to what camera rays hit by the batch's number of points; after a bounce, by one.
template <class Model>
void Wavefront<Model>::shade_lights(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
  const std::uint32_t soft_points = depth == 0 ? batch_.light_points : 1;
  const double budget =
      needs<&Requirements::many_lights>() ? scene_.accuracy.cutoff / static_cast<double>(scene_.lights.size()) : 0;
  culled_radiance_.assign(needs<&Requirements::many_lights>() ? hit_ray_.size() : 0, 0);
  const std::uint32_t nearest = approximate().nearest_lights;
  if (nearest != 0) nearest_.choose(scene_.lights, position_, nearest);
  for (std::uint32_t number = 0; number < scene_.lights.size(); ++number) {
    const CompiledLight& light = scene_.lights[number];
    const std::uint32_t points = light.is_area_light() ? soft_points : 1;
    for (std::uint32_t point = 0; point < points; ++point) {
      if (control_.cancelled()) return;
      const double so_far = number + (point + 1.0) / points;
      shade_light(rays, {light, number, point, points, budget * so_far}, coherence);
    }
  }
  for (const double culled : culled_radiance_)
    statistics_.culled_radiance += static_cast<std::uint64_t>(std::ceil(culled / scene_.accuracy.cutoff * 0x1p20));
}

/// The samples of a pixel share one sequence per light and path, so that their points are stratified together;
/// shuffled, since the same index chose the place in the pixel.
template <class Model>
Vec3 Wavefront<Model>::sample_area_light(const LightStep& step, const RayQueue& rays, std::size_t ray) const {
  const Batch::Sample& sample = batch_.samples[rays.sample(ray)];
  const std::uint64_t choice = (std::uint64_t{rays.path(ray)} << 32) | (step.number + 1);
  return light_point(step.light,
                     shuffled_point(sample.index * step.points + step.point, mix(sample.key ^ mix(choice))));
}

/// Where the light is to the places of a packet. One that is not soft is where it was to the packet before.
template <class Model>
void Wavefront<Model>::place_light(const LightStep& step, const RayQueue& rays, const ShadingPointPacket* packet) {
  for (int lane = 0; lane < (packet != nullptr ? packet->count : lanes); ++lane) {
    const Vec3 from =
        packet != nullptr ? sample_area_light(step, rays, hit_ray_[packet->hit[lane]]) : step.light.position;
    light_sample_.from_x[lane] = from.x;
    light_sample_.from_y[lane] = from.y;
    light_sample_.from_z[lane] = from.z;
  }
}

template <class Model>
void Wavefront<Model>::shade_light(const RayQueue& rays, const LightStep& step, Coherence coherence) {
  shadow_.clear();
  if (!step.light.is_area_light()) place_light(step, rays, nullptr);
  for (const ShadingPointQueue* places : {&shading_points_, &corner_points_})
    for (std::size_t i = 0; i < places->packets(); ++i) light_packet(rays, step, places->packet(i));
  statistics_.rays.shadow += shadow_.size();
  shadow_.add_to(radiance_, media_, coherence);
}

template <class Model>
void Wavefront<Model>::light_packet(const RayQueue& rays, const LightStep& step, const ShadingPointPacket& packet) {
  if (step.light.is_area_light()) place_light(step, rays, &packet);
  sample_light(packet, step.light, scene_.frame.world_from_render(1.0), 1.0 / step.points, light_sample_);
  // Together: a packet in a scene without any of them pays one test.
  const bool sorts_out = !step.light.shadows || may_cull_shadow_rays() || approximate().nearest_lights != 0 ||
                         needs<&Requirements::bump>();
  if (sorts_out)
    for_each_lane(light_sample_.gaining, [&](int lane) {
      if (!needs_shadow_ray(rays, step, packet, lane)) light_sample_.gaining &= ~(LaneMask{1} << lane);
    });
  if (light_sample_.gaining != 0) shadow_.append(packet, light_sample_);
}

/// Whether what the light gives, if nothing is in the way, is too little to ask. Lights share what may be missing of a
/// hit, `cutoff`: each may leave out its own share and what those before it have not used.
template <class Model>
bool Wavefront<Model>::is_negligible(const RayQueue& rays, std::size_t hit, const LightStep& step,
                                     const Color& contribution) {
  const double culled = culled_radiance_[hit] + max_component(contribution);
  if (!(culled <= step.budget)) return false;
  ++statistics_.culled_shadow_rays;
  omitted_[rays.sample(hit_ray_[hit])].culled += static_cast<float>(max_component(contribution));
  culled_radiance_[hit] = culled;
  return true;
}

/// By approximation: without shadows everything is; a map knows what is finite, and planes are asked themselves.
template <class Model>
bool Wavefront<Model>::approximately_visible(const LightStep& step, const ShadingPointPacket& packet, int lane,
                                             const Vec3& to_light, const Vec3& origin) const {
  if (approximate().shadows == Approximations::Shadows::none) return true;
  const Vec3 place{packet.x[lane], packet.y[lane], packet.z[lane]};
  const Vec3 face{packet.face_x[lane], packet.face_y[lane], packet.face_z[lane]};
  if (!scene_.shadow_maps[step.number].lit(place, face)) return false;
  const double short_of_it = light_sample_.distance[lane] * (1 - 0x1p-40);  // as shadow rays are
  return !plane_between(scene_.geometry(), origin, to_light, short_of_it, packet.from[lane]);
}

/// Whether a shadow ray must tell what a place gains of the light that would arrive. False: it gains all of it, where
/// the light casts no shadows or an approximation says so, or nothing: of lights that do not count, of too little
/// light, of light from behind the surface that a bent normal faces. Out of line, for scenes without any of these.
template <class Model>
__attribute__((noinline)) bool Wavefront<Model>::needs_shadow_ray(const RayQueue& rays, const LightStep& step,
                                                                  const ShadingPointPacket& packet, int lane) {
  const std::size_t hit = packet.hit[lane];
  const Vec3 to_light = light_sample_.to_light(lane);
  if (approximate().nearest_lights != 0 && !nearest_.count(hit, step.number)) return false;
  if (needs<&Requirements::bump>() && dot(unperturbed_normal_[hit], to_light) < 0) return false;
  const bool exact = approximate().shadows == Approximations::Shadows::exact;
  if (step.light.shadows && exact)
    return !may_cull_shadow_rays() || !is_negligible(rays, hit, step, light_sample_.color(lane));
  if (!step.light.shadows || approximately_visible(step, packet, lane, to_light, light_sample_.origin(lane)))
    radiance_[packet.sample[lane]] += light_sample_.color(lane);
  return false;
}

}  // namespace tracer
