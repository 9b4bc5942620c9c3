#pragma once
/// Wavefront, mirrors and glass: what goes on from a hit.

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::branch(const RayQueue& rays, const FacingPacket& facing, Generation& next) {
  const bool only_mirrors = !hit_.terms.any_branches && !needs<&Requirements::filtered_textures>() &&
                            approximate().reflections != Approximations::Reflections::environment;
  if (only_mirrors) return mirror_packet(facing, next);
  // Lane by lane: of hits of one sample the order in which their branches are queued must not depend on the packet.
  for (int lane = 0; lane < hit_.count; ++lane) {
    const MaterialTerms& terms = terms_of_lane(lane);
    if (terms.branches || !is_black(terms.mirror)) branch_at(rays, surface_of_lane(facing, lane), lane, next);
  }
}

/// The same bits as branch_at's.
template <class Model>
void Wavefront<Model>::mirror_packet(const FacingPacket& facing, Generation& next) {
  mirror(hit_, facing, mirrored_);
  const double cutoff = scene_.accuracy.cutoff;
  LaneMask going_on = 0;
  for_each_lane(hit_.terms.mirrors & first_lanes(hit_.count), [&](int i) {
    const double largest = mirrored_.largest[i];
    if (largest < cutoff || largest == 0) {
      const double survival = survives(largest, facing.sample[i], std::uint64_t{hit_.path[i]} * 2);
      if (!(survival > 0)) return;
      const double stands_for = 1 / survival;
      mirrored_.r[i] *= stands_for;
      mirrored_.g[i] *= stands_for;
      mirrored_.b[i] *= stands_for;
    }
    going_on |= LaneMask{1} << i;
  });
  if (next.depth > scene_.accuracy.max_depth) {
    for_each_lane(going_on, [&](int i) {
      truncate(std::max({mirrored_.r[i], mirrored_.g[i], mirrored_.b[i]}), facing.sample[i]);
    });
  } else if (going_on != 0) {
    const MirroredPacket& m = mirrored_;
    next.reflection.append(
        {m.ox, m.oy, m.oz, m.dx, m.dy, m.dz, m.r, m.g, m.b, facing.sample, facing.from, m.path, facing.media},
        going_on);
  }
}

template <class Model>
void Wavefront<Model>::branch_at(const RayQueue& rays, const Surface& surface, int lane, Generation& next) {
  using Transparency = Material::Transparency;
  const Material& material = scene_.materials[surface.material];
  const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
  const Vec3 direction = rays.direction(ray);
  const Vec3 outward = surface.back ? -surface.geometric_normal : surface.geometric_normal;
  // An interpolated normal may face away from the ray; the face's never does.
  const Vec3 normal = dot(direction, surface.normal) < 0 ? surface.normal : outward;
  const double cos_i = std::min(1.0, -dot(direction, normal));
  const bool transmits = material.transmission > 0;
  const bool refracts = transmits && material.transparency == Transparency::refract;
  const Media::List before = rays.media(ray);
  Media::List after = before;
  double n_from = media_.ior(media_.filling(before)), n_to = material.ior;
  if (transmits) {
    after = surface.back ? media_.leave(before, surface.object) : media_.enter(before, surface.object);
    if (refracts) n_to = media_.ior(media_.filling(after));
    // From behind, of a surface that was never entered: it has no inside, and its back counts as one.
    if (refracts && surface.back && after == before) n_from = material.ior;
  }
  Color reflected_weight = material.reflection_color * material.reflection;
  Color transmitted_weight = Color{1, 1, 1} * material.transmission;
  if (material.transparency != Transparency::interpolated)
    transmitted_weight = transmitted_weight * material.transmission_color;
  Vec3 onward = direction;
  const double curvature = needs<&Requirements::filtered_textures>()
                               ? (surface.back ? -1 : 1) * curvature_at(scene_, hits_.primitive[ray])
                               : 0;
  RayCone onward_cone, mirrored_cone;
  if (needs<&Requirements::filtered_textures>()) {
    onward_cone =
        tracer::refracted(rays.cone(ray), hits_.t[ray], refracts ? curvature : 0, refracts ? n_from / n_to : 1);
    mirrored_cone = tracer::mirrored(rays.cone(ray), hits_.t[ray], curvature);
  }
  if (refracts || material.fresnel) {
    const Interface interface = dielectric_interface(cos_i, n_from, n_to);
    if (material.fresnel) {
      reflected_weight = reflected_weight * interface.reflectance;
      transmitted_weight = transmitted_weight * (1 - interface.reflectance);
    } else if (interface.total_internal_reflection) {
      reflected_weight += transmitted_weight;
    }
    if (interface.total_internal_reflection) {
      transmitted_weight = {};
    } else if (refracts) {
      onward = refracted(direction, normal, cos_i, interface.cos_t, n_from, n_to);
      // Refracted by a bent normal, a grazing ray can stay on its side: mirror it in the face too.
      if (needs<&Requirements::bump>() && dot(onward, outward) > 0) onward = unit(reflected(onward, outward));
    }
  }
  if (!is_black(transmitted_weight))
    emit(next, &Generation::refraction, rays, surface, lane, onward, transmitted_weight, after, onward_cone);
  if (is_black(reflected_weight)) return;
  Vec3 mirrored = unit(reflected(direction, normal));
  // Mirrored in an interpolated normal, a grazing ray can end up inside: mirror it once more in the face.
  if (dot(mirrored, outward) < 0) mirrored = unit(reflected(mirrored, outward));
  emit(next, &Generation::reflection, rays, surface, lane, mirrored, reflected_weight, before, mirrored_cone);
}

/// The probability with which a branch of less weight than `cutoff` was kept; 0: it was not. Kept ones stand for those
/// that were not, and nothing is missing in the mean (Arvo & Kirk 1990, "Particle Transport and Image Synthesis").
template <class Model>
double Wavefront<Model>::survives(double most, std::uint32_t sample, std::uint64_t bounce) {
  if (scene_.accuracy.cutoff_by_chance && most > 0) {
    const Batch::Sample& choices = samples_[sample];
    const std::uint64_t chance = mix(mix(choices.key ^ mix(choices.index)) ^ mix(~bounce));
    const double survival = most / scene_.accuracy.cutoff;
    if (static_cast<double>(chance >> 11) * 0x1p-53 < survival) return survival;
  } else {
    missing_[sample].cutoff += static_cast<float>(most);
  }
  ++statistics_.cut_branches;
  return 0;
}

/// A branch that `max_depth` ends.
template <class Model>
void Wavefront<Model>::truncate(double largest, std::uint32_t sample) {
  ++statistics_.truncated_branches;
  missing_[sample].depth += static_cast<float>(largest);
}

template <class Model>
void Wavefront<Model>::emit(Generation& next, RayQueue Generation::*kind, const RayQueue& rays, const Surface& surface,
                            int lane, const Vec3& direction, const Color& factor, Media::List media,
                            const RayCone& cone) {
  const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
  // Reflections and refractions of one ray must not make the same random choices.
  const std::uint64_t bounce = std::uint64_t{rays.path(ray)} * 2 + (kind == &Generation::reflection ? 0 : 1);
  Color weight = hit_.weight(lane) * factor;
  if (max_component(weight) < scene_.accuracy.cutoff || is_black(weight)) {
    const double survival = survives(max_component(weight), rays.sample(ray), bounce);
    if (!(survival > 0)) return;
    weight = weight * (1 / survival);
  }
  if (next.depth > scene_.accuracy.max_depth) return truncate(max_component(weight), rays.sample(ray));
  if (approximate().reflections == Approximations::Reflections::environment) {
    radiance_[rays.sample(ray)] += weight * scene_.background->radiance(direction, std::abs(cone.spread));
    return;
  }
  (next.*kind)
      .push(offset_origin(surface.point, surface.geometric_normal, direction), direction, weight, rays.sample(ray),
            hits_.primitive[ray], static_cast<std::uint32_t>(mix(bounce)), media);
  if (needs<&Requirements::filtered_textures>()) (next.*kind).widen(cone);
}

}  // namespace tracer
