#pragma once
/// Wavefront: generations, hits and what lies around them.

#include <algorithm>
#include <new>

#include "tracer/src/integrators/whitted/wavefront.h"

namespace tracer {
/// Rays waiting at once, over all generations: 2^24 take about 2 GiB. Only a scene whose materials give back more light
/// than they receive, traced to a great depth, comes near.
inline constexpr std::size_t pending_max = std::size_t{1} << 24;

template <class Model>
bool Wavefront<Model>::trace() {
  const std::size_t count = batch_.samples.size();
  radiance_.resize(count);
  std::fill(radiance_.begin(), radiance_.end(), Color{});  // its loop is inline, assign's is not always
  if (may_omit_radiance()) omitted_.assign(count, {});
  media_.reset();
  if (writes_gbuffer()) gbuffer_.reset(count);
  statistics_.samples += count;
  std::vector<BounceQueues> pending;
  pending.push_back(acquire_queues(0));
  generate_camera_rays(pending.back().camera);
  std::size_t pending_rays = count;
  while (!pending.empty()) {
    if (control_.cancelled()) return false;
    BounceQueues generation = std::move(pending.back());
    pending.pop_back();
    if (generation.size() > bounce_rays_max) {
      auto [first, second] = split(generation);
      pending.push_back(std::move(second));
      pending.push_back(std::move(first));
      continue;
    }
    BounceQueues next = acquire_queues(generation.depth + 1);
    trace_bounce(generation, next);
    pending_rays += next.size() - generation.size();
    if (pending_rays > pending_max) throw std::bad_alloc();
    release_queues(std::move(generation));
    if (next.size() != 0) {
      pending.push_back(std::move(next));
    } else {
      release_queues(std::move(next));
    }
  }
  if (scene_.depth_cue) apply_depth_cue();
  for (const Color& sample : radiance_) statistics_.non_finite += finite(sample) ? 0 : 1;
  return true;
}

/// An empty one, with the memory of one that was traced where there is any.
template <class Model>
BounceQueues Wavefront<Model>::acquire_queues(std::uint32_t depth) {
  BounceQueues generation;
  if (!released_queues_.empty()) {
    generation = std::move(released_queues_.back());
    released_queues_.pop_back();
    generation.clear();
  }
  generation.depth = depth;
  return generation;
}

/// Two are in use at a time but where generations are split, which is rare.
template <class Model>
void Wavefront<Model>::release_queues(BounceQueues generation) {
  if (released_queues_.size() < 2) released_queues_.push_back(std::move(generation));
}

template <class Model>
void Wavefront<Model>::generate_camera_rays(RayQueue& rays) const {
  const auto& [samples, x, y, lens, share, light_points] = batch_;
  const std::size_t count = samples.size();
  const CompiledCamera::CameraRaySpan to = rays.start_over(count, MediumStack::camera(scene_));
  if (needs<&Requirements::lens>()) {
    for (std::size_t i = 0; i < count; ++i) to.put(i, scene_.camera.generate_ray(x[i], y[i], lens[i]));
  } else {
    scene_.camera.generate_rays(x.data(), y.data(), count, to);
  }
  if (needs<&Requirements::filtered_textures>())
    for (std::size_t i = 0; i < count; ++i) rays.widen(i, camera_cone(scene_, rays.direction(i), share[i]));
}

template <class Model>
void Wavefront<Model>::trace_bounce(const BounceQueues& generation, BounceQueues& next) {
  statistics_.rays.camera += generation.camera.size();
  statistics_.rays.reflection += generation.reflection.size();
  statistics_.rays.refraction += generation.refraction.size();
  for (const RayQueue* queue : {&generation.camera, &generation.reflection, &generation.refraction})
    if (!queue->empty()) process_queue(*queue, generation.depth, next);
}

template <class Model>
void Wavefront<Model>::process_queue(const RayQueue& rays, std::uint32_t depth, BounceQueues& next) {
  const Coherence coherence = depth == 0 ? Coherence::coherent : Coherence::incoherent;
  intersect(rays, depth, coherence);
  shade_hits(rays, depth, next);
  shade_lights(rays, depth, coherence);
}

template <class Model>
void Wavefront<Model>::intersect(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
  const std::size_t count = rays.size();
  const HitSpan answers = hits_.room_for(count);
  scene_.accelerator->intersect(rays.span(), answers, coherence);
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
  if (!missed_.empty()) handle_escaped_rays(rays, depth);
  if (writes_gbuffer() && depth == 0) write_gbuffer_depths(rays);
}

/// The weight that is left of a ray where it ends.
template <class Model>
Color Wavefront<Model>::throughput_at_hit(const RayQueue& rays, std::size_t ray) const {
  const Color throughput = rays.throughput(ray);
  return needs<&Requirements::absorption>() ? throughput * media_.transmittance(rays.media(ray), hits_.t[ray])
                                            : throughput;
}

template <class Model>
void Wavefront<Model>::handle_escaped_rays(const RayQueue& rays, std::uint32_t depth) {
  if (depth == 0 && scene_.output.alpha) return;  // transparent
  const Color* plain = scene_.background->plain();
  if (plain != nullptr && is_black(*plain)) return;
  if (plain != nullptr && !needs<&Requirements::absorption>()) {
    for (const std::uint32_t ray : missed_) radiance_[rays.sample(ray)] += rays.throughput(ray) * *plain;
    return;
  }
  const bool looks_up = needs<&Requirements::environment>() && needs<&Requirements::filtered_textures>();
  for (const std::uint32_t ray : missed_) {
    const double spread = looks_up ? std::abs(rays.cone(ray).spread) : 0;
    const Color seen = plain != nullptr ? *plain : scene_.background->radiance(rays.direction(ray), spread);
    radiance_[rays.sample(ray)] += throughput_at_hit(rays, ray) * seen;
  }
}

template <class Model>
void Wavefront<Model>::write_gbuffer_depths(const RayQueue& rays) {
  for (const std::uint32_t ray : hit_ray_)
    gbuffer_.depth[rays.sample(ray)] =
        scene_.frame.world_from_render(scene_.camera.depth(rays.direction(ray), hits_.t[ray]));
}

template <class Model>
void Wavefront<Model>::apply_depth_cue() {
  for (std::size_t sample = 0; sample < radiance_.size(); ++sample) {
    if (!gbuffer_.hit(sample) && scene_.output.alpha) continue;  // transparent
    const double scale = depth_cue_scale(*scene_.depth_cue, gbuffer_.depth[sample]);
    radiance_[sample] = radiance_[sample] * scale + scene_.depth_cue->color * (1 - scale);
  }
}

}  // namespace tracer
