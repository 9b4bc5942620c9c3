#pragma once
/// Wavefront: generations, hits and what lies around them.

#include <algorithm>
#include <new>

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/shapes/point_packet.h"

namespace tracer {
/// Rays waiting at once, over all generations: 2^24 take about 2 GiB. Only a scene whose materials give back more light
/// than they receive, traced to a great depth, comes near.
inline constexpr std::size_t pending_max = std::size_t{1} << 24;

template <class Model>
bool Wavefront<Model>::trace(Batch batch) {
  samples_ = std::move(batch.samples);
  light_points_ = batch.light_points;
  radiance_.resize(samples_.size());
  std::fill(radiance_.begin(), radiance_.end(), Color{});  // its loop is inline, assign's is not always
  if (may_miss_light()) missing_.assign(samples_.size(), {});
  media_.reset();
  if (notes_first_hits()) first_hits_.reset(samples_.size());
  statistics_.samples += samples_.size();
  std::vector<Generation> pending;
  pending.push_back(fresh_generation(0));
  aim_camera_rays(batch, pending.back().camera);
  std::size_t pending_rays = samples_.size();
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
    Generation next = fresh_generation(generation.depth + 1);
    trace_generation(generation, next);
    pending_rays += next.size() - generation.size();
    if (pending_rays > pending_max) throw std::bad_alloc();
    spend(std::move(generation));
    if (next.size() != 0) {
      pending.push_back(std::move(next));
    } else {
      spend(std::move(next));
    }
  }
  if (scene_.depth_cue) apply_depth_cue();
  for (const Color& sample : radiance_) statistics_.non_finite += finite(sample) ? 0 : 1;
  return true;
}

/// An empty one, with the memory of one that was traced where there is any.
template <class Model>
Generation Wavefront<Model>::fresh_generation(std::uint32_t depth) {
  Generation generation;
  if (!spent_.empty()) {
    generation = std::move(spent_.back());
    spent_.pop_back();
    generation.clear();
  }
  generation.depth = depth;
  return generation;
}

/// Two are in use at a time but where generations are split, which is rare.
template <class Model>
void Wavefront<Model>::spend(Generation generation) {
  if (spent_.size() < 2) spent_.push_back(std::move(generation));
}

template <class Model>
void Wavefront<Model>::aim_camera_rays(const Batch& batch, RayQueue& rays) const {
  const std::size_t count = samples_.size();
  const TraceCamera::AimSpan to = rays.start_over(count, Media::camera(scene_));
  if (needs<&Requirements::lens>()) {
    for (std::size_t i = 0; i < count; ++i) to.put(i, scene_.camera.aim(batch.x[i], batch.y[i], batch.lens[i]));
  } else {
    scene_.camera.aim_each(batch.x.data(), batch.y.data(), count, to);
  }
  if (needs<&Requirements::filtered_textures>())
    for (std::size_t i = 0; i < count; ++i) rays.widen(i, camera_cone(scene_, rays.direction(i), batch.share[i]));
}

template <class Model>
void Wavefront<Model>::trace_generation(const Generation& generation, Generation& next) {
  statistics_.rays.camera += generation.camera.size();
  statistics_.rays.reflection += generation.reflection.size();
  statistics_.rays.refraction += generation.refraction.size();
  for (const RayQueue* queue : {&generation.camera, &generation.reflection, &generation.refraction})
    if (!queue->empty()) trace_queue(*queue, generation.depth, next);
}

template <class Model>
void Wavefront<Model>::trace_queue(const RayQueue& rays, std::uint32_t depth, Generation& next) {
  const Coherence coherence = depth == 0 ? Coherence::coherent : Coherence::incoherent;
  gather(rays, depth, coherence, next);
  if (needs<&Requirements::bump>()) bend_normals(rays);
  shade_own_light(rays);
  if (notes_first_hits() && depth == 0) note_first_hits(rays);
  shade_lights(rays, depth, coherence);
  const bool sees_environment = approximate().reflections == Approximations::Reflections::environment;
  if (needs<&Requirements::reflection>() || needs<&Requirements::refraction>() || sees_environment) branch(rays, next);
}

template <class Model>
void Wavefront<Model>::gather(const RayQueue& rays, std::uint32_t depth, Coherence coherence, Generation& next) {
  const std::size_t count = rays.size();
  const HitSpan answers = hits_.resized(count);
  scene_.accelerator->closest(rays.span(), answers, coherence);
  PointPacket packet;
  hit_ray_.clear();
  surface_.clear();
  weight_.clear();
  const bool absorbs = needs<&Requirements::absorption>();
  const bool hides = needs<&Requirements::overlapping_media>() && needs<&Requirements::refraction>();
  for (std::size_t i = 0; i < count; ++i) {
    if (i % lanes == 0) meet_points(scene_.geometry(), rays.span(), answers, i, packet);
    Color weight = rays.weight(i);
    if (absorbs) weight = weight * media_.transmittance(rays.media(i), hits_.t[i]);
    if (!hits_.primitive[i].hit()) {
      see_background(rays, i, weight, depth);
      continue;
    }
    Surface& surface = surface_.emplace_back();
    if (packet.known[i % lanes] > 0) {
      surface_of(scene_, hits_.at(i), packet.point(i % lanes), packet.normal(i % lanes), rays.direction(i), surface);
    } else {
      surface = surface_at(scene_, hits_.at(i), rays.origin(i), rays.direction(i), approximate().shading);
    }
    if (hides && pass_hidden(rays, i, surface, weight, next)) {
      surface_.pop_back();
      continue;
    }
    hit_ray_.push_back(static_cast<std::uint32_t>(i));
    weight_.push_back(weight);
  }
}

template <class Model>
void Wavefront<Model>::see_background(const RayQueue& rays, std::size_t ray, const Color& weight, std::uint32_t depth) {
  if (depth == 0 && scene_.output.alpha) return;  // transparent
  const bool looks_up = needs<&Requirements::environment>() && needs<&Requirements::filtered_textures>();
  const double spread = looks_up ? std::abs(rays.cone(ray).spread) : 0;
  radiance_[rays.sample(ray)] += weight * scene_.background->radiance(rays.direction(ray), spread);
}

template <class Model>
void Wavefront<Model>::note_first_hits(const RayQueue& rays) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits_.primitive[i].hit()) continue;
    first_hits_.depth[rays.sample(i)] =
        scene_.frame.world_from_trace(scene_.camera.depth(rays.direction(i), hits_.t[i]));
  }
  for (std::size_t hit = 0; hit < hit_ray_.size(); ++hit) {
    const std::uint32_t sample = rays.sample(hit_ray_[hit]);
    first_hits_.normal[sample] = surface_[hit].normal;
    first_hits_.albedo[sample] = color_[hit];
    first_hits_.object[sample] = surface_[hit].object;
  }
}

template <class Model>
void Wavefront<Model>::apply_depth_cue() {
  for (std::size_t sample = 0; sample < radiance_.size(); ++sample) {
    if (!first_hits_.hit(sample) && scene_.output.alpha) continue;  // transparent
    const double scale = depth_cue_scale(*scene_.depth_cue, first_hits_.depth[sample]);
    radiance_[sample] = radiance_[sample] * scale + scene_.depth_cue->color * (1 - scale);
  }
}

/// A surface of a solid that does not fill the place on either side is not there: the ray goes straight on.
template <class Model>
bool Wavefront<Model>::pass_hidden(const RayQueue& rays, std::size_t ray, const Surface& surface, const Color& weight,
                                   Generation& next) {
  if (!(scene_.materials[surface.material].transmission > 0)) return false;
  const Media::List before = rays.media(ray);
  const Media::List after = surface.back ? media_.leave(before, surface.object) : media_.enter(before, surface.object);
  if (after == before || media_.filling(before) != media_.filling(after)) return false;
  if (next.depth > scene_.accuracy.max_depth) {
    ++statistics_.truncated_branches;
    missing_[rays.sample(ray)].depth += static_cast<float>(max_component(weight));
    return true;
  }
  const Vec3 direction = rays.direction(ray);
  next.refraction.push(offset_origin(surface.point, surface.geometric_normal, direction), direction, weight,
                       rays.sample(ray), hits_.primitive[ray], rays.path(ray), after);
  if (needs<&Requirements::filtered_textures>())
    next.refraction.widen({rays.cone(ray).width_at(hits_.t[ray]), rays.cone(ray).spread});
  return true;
}

}  // namespace tracer
