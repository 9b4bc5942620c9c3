#include "tracer/src/integrators/whitted/direct_lighting.h"

#include <limits>
#include <numeric>
#include <utility>

#include "tracer/src/math/power.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

WHITTLE_INLINE void directions_to_points(const ShadingPointPacket& f, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 offset = a.from[i] - f.position[i];
    const double distance = length(offset);
    a.distance[i] = distance;
    a.to_light.set(i, offset / distance);  // a light on the surface has no direction: NaN, which lights nothing
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void directions_along_axis(const Vec3& axis, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    a.distance[i] = std::numeric_limits<double>::infinity();
    a.to_light.set(i, axis);
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void attenuate(const Attenuation& attenuation, double world_per_render, LightSamplePacket& a) {
  const std::array<double, 3> c = attenuation.coefficients;
  if (attenuation.kind == Attenuation::Kind::polynomial)
    for (int i = 0; i < lanes; ++i) a.strength[i] *= polynomial_attenuation(c, a.distance[i] * world_per_render);
  if (attenuation.kind == Attenuation::Kind::inverse_square)
    for (int i = 0; i < lanes; ++i) a.strength[i] *= inverse_square_attenuation(a.distance[i] * world_per_render);
}

WHITTLE_INLINE void apply_spot_cone(const CompiledLight& light, LightSamplePacket& a) {
  const Vec3 axis = light.axis;
  const double inner = light.cos_inner, outer = light.cos_outer;
  for (int i = 0; i < lanes; ++i) a.strength[i] *= spot_factor(-dot(a.to_light[i], axis), inner, outer);
}

/// Returns the lanes whose normals point to the side of the light.
WHITTLE_INLINE LaneMask eval_cosine(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.cosine[i] = dot(f.normal[i], a.to_light[i]);
  LaneMask front = 0;
  for (int i = 0; i < lanes; ++i) front |= lane_bit(i, a.cosine[i] > 0);
  return front & first_lanes(f.count);
}

WHITTLE_INLINE void eval_reflection_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.highlight[i] = phong_cosine(f.normal[i], a.to_light[i], f.to_eye[i]);
}

WHITTLE_INLINE void eval_half_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = blinn_cosine(f.normal[i], a.to_light[i], f.to_eye[i]);
    a.highlight[i] = f.specular_model[i] == 2 ? cosine : a.highlight[i];
  }
}

/// Specular terms of light that comes through the surface.
WHITTLE_INLINE void eval_transmitted_highlight(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i)
    a.highlight[i] = transmitted_cosine(f.normal[i], a.to_light[i], f.to_eye[i], f.eta[i]);
  for (int i = 0; i < lanes; ++i) a.highlight[i] = power_of(a.highlight[i], f.shininess[i]);
  for (int i = 0; i < lanes; ++i) {
    const bool passes = (a.cosine[i] > 0) & !is_totally_reflected(a.cosine[i], f.eta[i]);
    a.highlight[i] = (f.specular_model[i] != 0) & passes ? a.highlight[i] : 0;
  }
}

WHITTLE_INLINE void eval_highlight(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.highlight[i] = power_of(a.highlight[i], f.shininess[i]);
  for (int i = 0; i < lanes; ++i) a.highlight[i] = (f.specular_model[i] != 0) & (a.cosine[i] > 0) ? a.highlight[i] : 0;
}

WHITTLE_INLINE void eval_diffuse(const ShadingPointPacket& f, const Color& radiance, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.radiance.set(i, f.diffuse[i] * a.cosine[i] * radiance * a.strength[i]);
}

WHITTLE_INLINE void eval_diffuse_and_specular(const ShadingPointPacket& f, const Color& radiance,
                                              LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i)
    a.radiance.set(i, (f.diffuse[i] * a.cosine[i] + f.specular[i] * a.highlight[i]) * radiance * a.strength[i]);
}

/// Replaces the light of the lanes with principled materials, lane by lane: by its tables, it is a long computation.
void eval_principled(const ShadingPointPacket& f, std::span<const PrincipledHit> principled, const Color& radiance,
                     LightSamplePacket& a) {
  for (int i = 0; i < f.count; ++i) {
    const PrincipledHit& hit = principled[f.hit[i]];
    if (!is_black(hit.weight)) a.radiance.set(i, hit.weight * hit.point.lit(a.to_light[i]) * radiance * a.strength[i]);
  }
}

/// offset_origin() with a given clearance.
WHITTLE_INLINE void offset_shadow_origins(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.origin.set(i, clear_of(f.position[i], f.face[i], f.clearance[i], a.to_light[i]));
}

/// Sets the origins, directions and distances of shadow rays from the curved surface that smooth normals suggest.
WHITTLE_INLINE void aim_from_smooth_surface(const ShadingPointPacket& f, bool directional, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 start = f.position[i] + f.shadow_offset[i], offset = a.from[i] - start;
    const double distance = length(offset);
    const bool parallel = directional | !(distance > 0);  // a light at the start itself: nothing lies between
    const Vec3 direction = select(parallel, a.to_light[i], offset / distance);
    a.shadow_direction.set(i, direction);
    a.shadow_distance[i] = directional ? a.distance[i] : distance;
    a.origin.set(i, clear_of(start, f.face[i], f.clearance[i], direction));
  }
}

WHITTLE_INLINE LaneMask black_lanes(const LightSamplePacket& a) {
  LaneMask black = 0;
  for (int i = 0; i < lanes; ++i) black |= lane_bit(i, is_black(a.radiance[i]));
  return black;
}

/// Shadow rays that continue behind transmissive surfaces, lane by lane with an IntersectionPacket.
struct alignas(64) ContinuedRays {
  VecLanes origin;
  double left[lanes];  ///< remaining distance to the light
  std::uint32_t number[lanes];
  MediumStack::List media[lanes];
};

/// Sets the origins behind the surfaces, and `back_face`.
WHITTLE_WIDE void offset_origins(IntersectionPacket& __restrict intersections, ContinuedRays& __restrict to) {
  const PointPacket& p = intersections.points;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction = intersections.direction[i], face = p.face[i];
    to.origin.set(i, offset_origin({p.position[i], p.error[i]}, face, direction));
    intersections.back_face[i] = dot(direction, face) > 0 ? 1 : 0;
  }
}

/// Appends the lanes of the mask to the first `used` elements of `values`.
void append_lanes(const double* packet, LaneMask mask, std::size_t used, std::vector<double>& values) {
  if (values.size() < used + lanes) values.resize(2 * used + lanes);
  const Compressed compressed{packet, &values[used]};
  compress_eights(&compressed, 1, mask);
}

/// sample_light() for one side of the surfaces.
template <bool far_side>
WHITTLE_INLINE void sample_side(const ShadingPointPacket& shading_points, const CompiledLight& light,
                                double world_per_render, double share, std::span<const PrincipledHit> principled,
                                LightSamplePacket& sample) {
  if (light.kind == light_kind<DirectionalLight>) {
    directions_along_axis(light.axis, share, sample);
  } else {
    directions_to_points(shading_points, share, sample);
    attenuate(light.attenuation, world_per_render, sample);
    if (light.kind == light_kind<SpotLight>) apply_spot_cone(light, sample);
  }
  sample.lit = eval_cosine(shading_points, sample);
  if (sample.lit == 0) return;  // common: neighbors share their orientation
  if (shading_points.any_specular) {
    if constexpr (far_side) {
      eval_transmitted_highlight(shading_points, sample);
    } else {
      eval_reflection_vector(shading_points, sample);
      if (shading_points.any_blinn) eval_half_vector(shading_points, sample);
      eval_highlight(shading_points, sample);
    }
    eval_diffuse_and_specular(shading_points, light.radiance, sample);
  } else {
    eval_diffuse(shading_points, light.radiance, sample);
  }
  if (!far_side && !principled.empty()) eval_principled(shading_points, principled, light.radiance, sample);
  sample.lit &= ~black_lanes(sample);
  if (!light.shadows) return;
  if (shading_points.smooth) {
    aim_from_smooth_surface(shading_points, light.kind == light_kind<DirectionalLight>, sample);
  } else {
    offset_shadow_origins(shading_points, sample);
  }
}

}  // namespace

WHITTLE_WIDE void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light,
                               double world_per_render, double share, std::span<const PrincipledHit> principled,
                               LightSamplePacket& sample) {
  sample_side<false>(shading_points, light, world_per_render, share, principled, sample);
}

WHITTLE_WIDE void sample_light_behind(const ShadingPointPacket& shading_points, const CompiledLight& light,
                                      double world_per_render, double share, std::span<const PrincipledHit> principled,
                                      LightSamplePacket& sample) {
  sample_side<true>(shading_points, light, world_per_render, share, principled, sample);
}

void ShadowRays::append(const ShadingPointPacket& packet, const LightSamplePacket& sample) {
  const std::size_t first = rays_.size();
  const VecLanes& direction = packet.smooth ? sample.shadow_direction : sample.to_light;
  const double* const distance = packet.smooth ? sample.shadow_distance : sample.distance;
  rays_.append({sample.origin, direction, &sample.radiance, packet.sample, packet.from, nullptr, packet.media},
               sample.lit);
  // Shorter than the distance by more than its rounding error, so that a surface at the light does not occlude it.
  double t_max[lanes];
  for (int i = 0; i < lanes; ++i) t_max[i] = distance[i] * (1 - 0x1p-40);
  append_lanes(t_max, sample.lit, first, distance_);
}

void ShadowRays::add_unoccluded(std::vector<Color>& radiance, MediumStack& media, Coherence coherence) {
  if (rays_.empty()) return;
  blocked_.resize(rays_.size());
  for_each_part(rays_.span(distance_.data()), control_, [&](const RaySpan& part, std::size_t first) {
    scene_.accelerator->occluded(part, blocked_.data() + first, coherence);
  });
  const bool transmissive = needs_.transmissive_shadows;
  if (transmissive) attenuate_transmissive(media);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    radiance[rays_.sample(i)] += transmissive ? rays_.throughput(i) * transmittance_[i] : rays_.throughput(i);
  }
}

/// Computes S_i of the rays that no opaque surface blocks: the product of K_t C_t over all crossed surfaces and of the
/// absorption between them, in the order of crossing.
void ShadowRays::attenuate_transmissive(MediumStack& media) {
  const std::size_t count = rays_.size();
  transmittance_.assign(count, {1, 1, 1});
  if (number_.size() < count) {
    number_.resize(count);
    std::iota(number_.begin(), number_.end(), 0u);
  }
  // Blocked rays keep their place; a NaN distance lets them hit nothing.
  for (std::size_t i = 0; i < count; ++i)
    distance_[i] = blocked_[i] != 0 ? std::numeric_limits<double>::quiet_NaN() : distance_[i];
  cross_next_surface({rays_, distance_.data(), number_.data()}, media);
  for (std::uint64_t crossings = 1; !next_.empty(); ++crossings) {
    if (crossings > scene_.accelerator->max_transmissive_hits() || control_.cancelled()) break;
    std::swap(crossing_, next_);
    std::swap(crossing_distance_, next_distance_);
    cross_next_surface({crossing_, crossing_distance_.data(), crossing_.payload().sample}, media);
  }
}

/// Traces each segment to its first transmissive surface and through it; `next_` receives the segments behind.
void ShadowRays::cross_next_surface(const RaySegments& from, MediumStack& media) {
  const std::size_t count = from.rays.size();
  const HitSpan crossed = crossed_.resize_to_fit(count);
  for_each_part(from.rays.span(from.distance), control_, [&](const RaySpan& part, std::size_t first) {
    scene_.accelerator->intersect(part, hits_from(crossed, first), Coherence::coherent, GeometryMask::transmissive);
  });
  if (hit_rays_.size() < count) hit_rays_.resize(count);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    hit_rays_[hits] = static_cast<std::uint32_t>(i);
    hits += crossed_.primitive[i].hit() ? 1 : 0;
  }
  for (std::size_t i = 0; needs_.absorption && i < count; ++i) {
    const std::uint32_t medium = media.current_medium(from.rays.media(i));
    if (medium != MediumStack::nothing && scene_.objects.shadowless[medium] != 0) continue;
    Color& transmittance = transmittance_[from.number[i]];
    const double length = crossed_.primitive[i].hit() ? crossed_.t[i] : from.distance[i];
    transmittance = transmittance * media.transmittance(from.rays.media(i), length);
  }
  next_.clear();
  for (std::size_t first = 0; first < hits; first += lanes) {
    load(from.rays, crossed_.span(), hit_rays_.data() + first,
         static_cast<int>(std::min<std::size_t>(lanes, hits - first)), intersections_);
    cross_packet(from, media);
  }
}

/// Transmittance of the surface that a lane crosses.
Color ShadowRays::textured_transmittance(int lane) const {
  const PointPacket& points = intersections_.points;
  Surface surface;
  surface.object = points.object[lane];
  surface.material = scene_.objects.material[surface.object];
  surface.point = {points.position[lane], points.error[lane]};
  surface.geometric_normal = points.face[lane];
  const Vec2 uv = uv_at(scene_, crossed_.at(static_cast<std::size_t>(intersections_.ray[lane])), surface);
  const auto color_of = [&](const ColorOrTexture& color) {
    const auto* id = std::get_if<TextureId>(&color);
    return id == nullptr ? std::get<Color>(color)
                         : texture_color(scene_.textures[id->index], uv, {}, scene_.images[id->index].get());
  };
  return transmittance(scene_.materials[surface.material], color_of);
}

void ShadowRays::cross_packet(const RaySegments& from, MediumStack& media) {
  ContinuedRays continued;
  const PointPacket& points = intersections_.points;
  compute_points(scene_.geometry(), intersections_.ray_hits, intersections_.points);
  offset_origins(intersections_, continued);
  LaneMask going = 0;
  for (int i = 0; i < intersections_.count; ++i) {
    const auto ray = static_cast<std::size_t>(intersections_.ray[i]);
    const std::uint32_t object = points.object[i];
    MediumStack::Crossing crossing{.after = from.rays.media(ray)};
    Color& transmittance = transmittance_[from.number[ray]];
    if (scene_.objects.shadowless[object] == 0) {
      const CompiledMaterial& material = scene_.terms[scene_.objects.material[object]];
      if ((needs_.absorption || needs_.overlapping_media) && material.transmits)
        crossing = media.cross(crossing.after, object, intersections_.back_face[i] > 0);
      if (!crossing.hidden)
        transmittance = transmittance * (material.textured ? textured_transmittance(i) : material.transmittance);
    }
    continued.number[i] = from.number[ray];
    continued.media[i] = crossing.after;
    continued.left[i] = from.distance[ray] - crossed_.t[ray];
    if (!is_black(transmittance) && continued.left[i] > 0) going |= lane_bit(i);
  }
  const std::size_t end = next_.size();
  next_.append({continued.origin, intersections_.direction, nullptr, continued.number,
                intersections_.ray_hits.primitive, nullptr, continued.media},
               going);
  append_lanes(continued.left, going, end, next_distance_);
}

}  // namespace tracer
