#pragma once
/// Wavefront: generations, hits and what lies around them.

#include <algorithm>
#include <new>

#include "tracer/src/integrator/wavefront.h"

namespace tracer {
/// Rays waiting at once, over all generations: 2^24 take about 2 GiB. Only a scene whose materials give back more light
/// than they receive, traced to a great depth, comes near.
inline constexpr std::size_t pending_max = std::size_t{1} << 24;

template <class Model>
bool Wavefront<Model>::trace() {
  const std::size_t count = batch_.samples.size();
  radiance_.resize(count);
  std::fill(radiance_.begin(), radiance_.end(), Color{});  // its loop is inline, assign's is not always
  if (may_miss_light()) missing_.assign(count, {});
  media_.reset();
  if (notes_first_hits()) first_hits_.reset(count);
  statistics_.samples += count;
  std::vector<Generation> pending;
  pending.push_back(fresh_generation(0));
  aim_camera_rays(pending.back().camera);
  std::size_t pending_rays = count;
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
void Wavefront<Model>::aim_camera_rays(RayQueue& rays) const {
  const auto& [samples, x, y, lens, share, light_points] = batch_;
  const std::size_t count = samples.size();
  const TraceCamera::AimSpan to = rays.start_over(count, Media::camera(scene_));
  if (needs<&Requirements::lens>()) {
    for (std::size_t i = 0; i < count; ++i) to.put(i, scene_.camera.aim(x[i], y[i], lens[i]));
  } else {
    scene_.camera.aim_each(x.data(), y.data(), count, to);
  }
  if (needs<&Requirements::filtered_textures>())
    for (std::size_t i = 0; i < count; ++i) rays.widen(i, camera_cone(scene_, rays.direction(i), share[i]));
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
  meet(rays, depth, coherence);
  shade_hits(rays, depth, next);
  shade_lights(rays, depth, coherence);
}

template <class Model>
void Wavefront<Model>::meet(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
  const std::size_t count = rays.size();
  const HitSpan answers = hits_.room_for(count);
  scene_.accelerator->closest(rays.span(), answers, coherence);
  hit_ray_.resize(count);
  missed_.resize(count);
  std::size_t hits = 0, missed = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool hit = answers.primitive[i].hit();
    hit_ray_[hits] = missed_[missed] = static_cast<std::uint32_t>(i);
    hits += hit ? 1 : 0;
    missed += hit ? 0 : 1;
  }
  hit_ray_.resize(hits);
  missed_.resize(missed);
  if (!missed_.empty()) see_background(rays, depth);
  if (notes_first_hits() && depth == 0) note_depths(rays);
}

/// The weight that is left of a ray where it ends.
template <class Model>
Color Wavefront<Model>::arriving_weight(const RayQueue& rays, std::size_t ray) const {
  const Color weight = rays.weight(ray);
  return needs<&Requirements::absorption>() ? weight * media_.transmittance(rays.media(ray), hits_.t[ray]) : weight;
}

template <class Model>
void Wavefront<Model>::see_background(const RayQueue& rays, std::uint32_t depth) {
  if (depth == 0 && scene_.output.alpha) return;  // transparent
  const Color* plain = scene_.background->plain();
  if (plain != nullptr && is_black(*plain)) return;
  if (plain != nullptr && !needs<&Requirements::absorption>()) {
    for (const std::uint32_t ray : missed_) radiance_[rays.sample(ray)] += rays.weight(ray) * *plain;
    return;
  }
  const bool looks_up = needs<&Requirements::environment>() && needs<&Requirements::filtered_textures>();
  for (const std::uint32_t ray : missed_) {
    const double spread = looks_up ? std::abs(rays.cone(ray).spread) : 0;
    const Color seen = plain != nullptr ? *plain : scene_.background->radiance(rays.direction(ray), spread);
    radiance_[rays.sample(ray)] += arriving_weight(rays, ray) * seen;
  }
}

template <class Model>
void Wavefront<Model>::note_depths(const RayQueue& rays) {
  for (const std::uint32_t ray : hit_ray_)
    first_hits_.depth[rays.sample(ray)] =
        scene_.frame.world_from_trace(scene_.camera.depth(rays.direction(ray), hits_.t[ray]));
}

template <class Model>
void Wavefront<Model>::apply_depth_cue() {
  for (std::size_t sample = 0; sample < radiance_.size(); ++sample) {
    if (!first_hits_.hit(sample) && scene_.output.alpha) continue;  // transparent
    const double scale = depth_cue_scale(*scene_.depth_cue, first_hits_.depth[sample]);
    radiance_[sample] = radiance_[sample] * scale + scene_.depth_cue->color * (1 - scale);
  }
}

}  // namespace tracer
