#include "tracer/src/integrator/wavefront.h"

#include <limits>
#include <new>

#include "tracer/src/lights/attenuation.h"
#include "tracer/src/materials/local_model.h"
#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

/// A generation larger than this is traced in parts, the first to its end before the second starts: memory then grows
/// with depth, not with the number of branches.
constexpr std::size_t generation_max = 16384;

/// A penumbra of 16 stratified points a pixel has a standard error of some 3 % of the light at worst.
constexpr std::uint32_t light_points_min = 16;

/// Rays waiting at once, over all generations: 2^24 take about 2 GiB. Only a scene whose materials give back more light
/// than they receive, traced to a great depth, comes near.
constexpr std::size_t pending_max = std::size_t{1} << 24;

/// Splits `whole` in two by samples; a single sample, by the order of its rays. Where a sample is cut depends on that
/// sample alone: one that shares its generation with others is first separated from them.
std::pair<Generation, Generation> split(const Generation& whole) {
  std::uint32_t low = std::numeric_limits<std::uint32_t>::max(), high = 0;
  const auto include = [&](const RayQueue& queue) {
    for (std::size_t i = 0; i < queue.size(); ++i) {
      low = std::min(low, queue.sample(i));
      high = std::max(high, queue.sample(i));
    }
  };
  for (const RayQueue* queue : {&whole.camera, &whole.reflection, &whole.refraction}) include(*queue);
  const std::uint32_t middle = low + (high - low) / 2;
  std::pair<Generation, Generation> parts;
  parts.first.depth = parts.second.depth = whole.depth;
  std::size_t order = 0;
  const auto distribute = [&](RayQueue Generation::*queue) {
    const RayQueue& from = whole.*queue;
    for (std::size_t i = 0; i < from.size(); ++i, ++order) {
      const bool first = low == high ? order < generation_max : from.sample(i) <= middle;
      ((first ? parts.first : parts.second).*queue).push(from, i);
    }
  };
  for (const auto queue : {&Generation::camera, &Generation::reflection, &Generation::refraction}) distribute(queue);
  return parts;
}

}  // namespace

bool Wavefront::trace(Batch batch) {
  samples_ = std::move(batch.samples);
  radiance_.assign(samples_.size(), Color{});
  statistics_.samples += samples_.size();
  std::vector<Generation> pending;
  std::size_t pending_rays = batch.camera.size();
  pending.push_back({.camera = std::move(batch.camera), .reflection = {}, .refraction = {}});
  while (!pending.empty()) {
    if (control_.cancelled()) return false;
    Generation generation = std::move(pending.back());
    pending.pop_back();
    if (generation.size() > generation_max) {
      auto [first, second] = split(generation);
      pending.push_back(std::move(second));
      pending.push_back(std::move(first));
      continue;
    }
    Generation next;
    next.depth = generation.depth + 1;
    trace_generation(generation, next);
    pending_rays += next.size() - generation.size();
    if (pending_rays > pending_max) throw std::bad_alloc();
    if (next.size() != 0) pending.push_back(std::move(next));
  }
  for (const Color& sample : radiance_) statistics_.non_finite += finite(sample) ? 0 : 1;
  return true;
}

void Wavefront::trace_generation(const Generation& generation, Generation& next) {
  statistics_.rays.camera += generation.camera.size();
  statistics_.rays.reflection += generation.reflection.size();
  statistics_.rays.refraction += generation.refraction.size();
  for (const RayQueue* queue : {&generation.camera, &generation.reflection, &generation.refraction})
    if (!queue->empty()) trace_queue(*queue, generation.depth, next);
}

void Wavefront::trace_queue(const RayQueue& rays, std::uint32_t depth, Generation& next) {
  const Coherence coherence = depth == 0 ? Coherence::coherent : Coherence::incoherent;
  gather(rays, coherence);
  shade_own_light(rays);
  shade_lights(rays, depth, coherence);
  if (scene_.needs.reflection || scene_.needs.refraction) branch(rays, next);
}

void Wavefront::gather(const RayQueue& rays, Coherence coherence) {
  const std::size_t count = rays.size();
  scene_.accelerator->closest(rays.span(), hits_.resized(count), coherence);
  hit_ray_.clear();
  surface_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    if (!hits_.primitive[i].hit()) {
      radiance_[rays.sample(i)] += rays.weight(i) * scene_.background;
      continue;
    }
    hit_ray_.push_back(static_cast<std::uint32_t>(i));
    surface_.push_back(surface_at(scene_, hits_.at(i), rays.origin(i), rays.direction(i)));
  }
}

void Wavefront::shade_own_light(const RayQueue& rays) {
  color_.clear();
  for (std::size_t i = 0; i < hit_ray_.size(); ++i) {
    const Material& material = scene_.materials[surface_[i].material];
    const auto* texture = std::get_if<TextureId>(&material.color);
    color_.push_back(texture != nullptr ? texture_color(scene_.textures[texture->index], surface_[i].uv)
                                        : std::get<Color>(material.color));
    const Color own = material.emission + scene_.ambient * color_.back() * material.ambient;
    radiance_[rays.sample(hit_ray_[i])] += rays.weight(hit_ray_[i]) * own;
  }
}

/// A soft light is known by as many points a hit that a pixel sees at least light_points_min of them; after a bounce,
/// by one.
void Wavefront::shade_lights(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
  const std::uint32_t samples = scene_.accuracy.samples;
  const std::uint32_t soft_points = depth == 0 ? (light_points_min + samples - 1) / samples : 1;
  for (std::uint32_t number = 0; number < scene_.lights.size(); ++number) {
    const TraceLight& light = scene_.lights[number];
    const std::uint32_t points = light.soft() ? soft_points : 1;
    for (std::uint32_t point = 0; point < points; ++point) {
      if (control_.cancelled()) return;
      shade_light(rays, {light, number, point, points}, coherence);
    }
  }
}

/// The samples of a pixel share one sequence per light and path, so that their points are stratified together.
Vec3 Wavefront::point_of(const LightStep& step, const RayQueue& rays, std::size_t ray) const {
  if (!step.light.soft()) return step.light.position;
  const Batch::Sample& sample = samples_[rays.sample(ray)];
  const std::uint64_t choice = (std::uint64_t{rays.path(ray)} << 32) | (step.number + 1);
  return light_point(step.light,
                     sequence_point(sample.index * step.points + step.point, mix(sample.key ^ mix(choice))));
}

void Wavefront::shade_light(const RayQueue& rays, const LightStep& step, Coherence coherence) {
  const TraceLight& light = step.light;
  const Color radiance = light.radiance * (1.0 / step.points);
  shadow_.clear();
  shadow_distance_.clear();
  for (std::size_t i = 0; i < hit_ray_.size(); ++i) {
    const Surface& surface = surface_[i];
    const Material& material = scene_.materials[surface.material];
    const std::uint32_t ray = hit_ray_[i];
    Vec3 to_light = light.axis;
    double distance = std::numeric_limits<double>::infinity();
    double fade = 1;
    if (light.kind != TraceLight::Kind::directional) {
      const Vec3 offset = point_of(step, rays, ray) - surface.point.position;
      distance = length(offset);
      if (!(distance > 0)) continue;  // the light touches the surface: no direction to shine from
      to_light = offset / distance;
      fade = attenuation_at(light.attenuation, scene_.frame.world_from_trace(distance)) * spot_factor(light, -to_light);
    }
    const double n_dot_l = dot(surface.normal, to_light);
    if (!(n_dot_l > 0)) continue;
    const double spec = material.specular > 0 ? specular_factor(material.model, material.shininess, surface.normal,
                                                                to_light, -rays.direction(ray))
                                              : 0;
    const Color reflected_light =
        color_[i] * (material.diffuse * n_dot_l) + material.specular_color * (material.specular * spec);
    const Color contribution = rays.weight(ray) * radiance * reflected_light * fade;
    if (is_black(contribution)) continue;
    if (!light.shadows) {
      radiance_[rays.sample(ray)] += contribution;
      continue;
    }
    shadow_.push(offset_origin(surface.point, surface.geometric_normal, to_light), to_light, contribution,
                 rays.sample(ray), hits_.primitive[ray], 0);
    // Short of the light by more than the rounding of its distance, so that what a light sits on does not hide it.
    shadow_distance_.push_back(distance * (1 - 0x1p-40));
  }
  if (!shadow_.empty()) add_unblocked(coherence);
}

void Wavefront::add_unblocked(Coherence coherence) {
  statistics_.rays.shadow += shadow_.size();
  blocked_.resize(shadow_.size());
  scene_.accelerator->occluded(shadow_.span(shadow_distance_.data()), blocked_.data(), coherence);
  if (scene_.needs.transmissive_shadows) cross_transmissive();
  for (std::size_t i = 0; i < shadow_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    radiance_[shadow_.sample(i)] +=
        scene_.needs.transmissive_shadows ? shadow_.weight(i) * visible_[i] : shadow_.weight(i);
  }
}

/// S_i of the shadow rays that no opaque surface blocks: the product of K_t C_t over every surface on the way to the
/// light, in the order they are crossed.
void Wavefront::cross_transmissive() {
  visible_.assign(shadow_.size(), {1, 1, 1});
  crossing_.clear();
  crossing_distance_.clear();
  for (std::size_t i = 0; i < shadow_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    crossing_.push(shadow_.origin(i), shadow_.direction(i), {}, static_cast<std::uint32_t>(i), shadow_.from(i), 0);
    crossing_distance_.push_back(shadow_distance_[i]);
  }
  while (!crossing_.empty() && !control_.cancelled()) {
    const std::size_t count = crossing_.size();
    scene_.accelerator->closest(crossing_.span(crossing_distance_.data()), crossed_.resized(count), Coherence::coherent,
                                Among::transmissive);
    crossing_next_.clear();
    crossing_distance_next_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const Hit hit = crossed_.at(i);
      if (!hit.primitive.hit()) continue;
      const Vec3 direction = crossing_.direction(i);
      const Surface surface = surface_at(scene_, hit, crossing_.origin(i), direction);
      const Material& material = scene_.materials[surface.material];
      Color& visible = visible_[crossing_.sample(i)];
      visible = visible * material.transmission_color * material.transmission;
      const double left = crossing_distance_[i] - hit.t;
      if (is_black(visible) || !(left > 0)) continue;
      crossing_next_.push(offset_origin(surface.point, surface.geometric_normal, direction), direction, {},
                          crossing_.sample(i), hit.primitive, 0);
      crossing_distance_next_.push_back(left);
    }
    std::swap(crossing_, crossing_next_);
    std::swap(crossing_distance_, crossing_distance_next_);
  }
}

void Wavefront::branch(const RayQueue& rays, Generation& next) {
  for (std::size_t i = 0; i < hit_ray_.size(); ++i) {
    const Surface& surface = surface_[i];
    const Material& material = scene_.materials[surface.material];
    if (material.reflection == 0 && material.transmission == 0) continue;
    const std::uint32_t ray = hit_ray_[i];
    const Vec3 direction = rays.direction(ray);
    const Vec3 outward = surface.back ? -surface.geometric_normal : surface.geometric_normal;
    // An interpolated normal may face away from the ray; the face's never does.
    const Vec3 normal = dot(direction, surface.normal) < 0 ? surface.normal : outward;
    const double cos_i = std::min(1.0, -dot(direction, normal));
    const bool leaving = surface.back && material.transmission > 0;
    const double n_from = leaving ? material.ior : 1, n_to = leaving ? 1 : material.ior;
    Color reflected_weight = material.reflection_color * material.reflection;
    Color transmitted_weight = material.transmission_color * material.transmission;
    if (material.transmission > 0 || material.fresnel) {
      const Interface interface = dielectric_interface(cos_i, n_from, n_to);
      if (material.fresnel) {
        reflected_weight = reflected_weight * interface.reflectance;
        transmitted_weight = transmitted_weight * (1 - interface.reflectance);
      } else if (interface.total_internal_reflection) {
        reflected_weight += transmitted_weight;
      }
      if (interface.total_internal_reflection) transmitted_weight = {};
      if (!is_black(transmitted_weight))
        emit(next, &Generation::refraction, rays, ray, surface,
             refracted(direction, normal, cos_i, interface.cos_t, n_from, n_to), transmitted_weight);
    }
    if (is_black(reflected_weight)) continue;
    Vec3 mirrored = unit(reflected(direction, normal));
    // Mirrored in an interpolated normal, a grazing ray can end up inside: mirror it once more in the face.
    if (dot(mirrored, outward) < 0) mirrored = unit(reflected(mirrored, outward));
    emit(next, &Generation::reflection, rays, ray, surface, mirrored, reflected_weight);
  }
}

void Wavefront::emit(Generation& next, RayQueue Generation::*kind, const RayQueue& rays, std::size_t ray,
                     const Surface& surface, const Vec3& direction, const Color& factor) {
  const Color weight = rays.weight(ray) * factor;
  if (max_component(weight) < scene_.accuracy.cutoff || is_black(weight)) {
    ++statistics_.cut_branches;
    return;
  }
  if (next.depth > scene_.accuracy.max_depth) {
    ++statistics_.truncated_branches;
    return;
  }
  // Reflections and refractions of one ray must not make the same random choices.
  const std::uint64_t bounce = std::uint64_t{rays.path(ray)} * 2 + (kind == &Generation::reflection ? 0 : 1);
  (next.*kind)
      .push(offset_origin(surface.point, surface.geometric_normal, direction), direction, weight, rays.sample(ray),
            hits_.primitive[ray], static_cast<std::uint32_t>(mix(bounce)));
}

}  // namespace tracer
