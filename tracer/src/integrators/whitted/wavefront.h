#pragma once
/// The Whitted integrator as a wavefront: a batch of samples is traced bounce by bounce. A queue of rays is
/// intersected, its hits are shaded in packets of 16, and the secondary rays fill the queues of the next bounce. There
/// is no recursion, so that depth alone costs no memory.

#include <algorithm>
#include <new>
#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"
#include "tracer/src/integrators/whitted/secondary_rays.h"
#include "tracer/src/integrators/whitted/texture_lookup.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace tracer {

/// The integrator for a set of features. Contributions to one sample are added in an order that depends on that sample
/// alone (bounce, then kind, then the order of the parents, then light), so that no choice of batch, tile or thread
/// changes a bit of the image.
template <class Features>
class Wavefront : public Tracer {
 public:
  Wavefront(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : state_(scene, control, approximations), textures_(state_), lighting_(state_), secondary_(state_) {}
  Wavefront(Wavefront&&) = delete;

  [[nodiscard]] Batch& batch() override { return state_.batch; }
  bool trace() override {
    BounceQueuesPtr first = acquire_queues(0);
    generate_camera_rays(first->camera);
    return trace_all(std::move(first));
  }
  /// Traces these rays in place of camera rays, one for each sample of the batch: samples without a place in the image.
  bool trace(const RayQueue& rays) {
    BounceQueuesPtr first = acquire_queues(0);
    first->camera = rays;
    return trace_all(std::move(first));
  }
  /// Traces diffuse rays in place of camera rays, one for each sample of the batch, and appends to `terminations` where
  /// their paths end at patches; radiance() is the rest. Precondition: the scene has patches.
  bool trace_from_patches(const RayQueue& diffuse, std::vector<PathTermination>& terminations) {
    BounceQueuesPtr first = acquire_queues(1);
    first->diffuse = diffuse;
    state_.terminations = &terminations;
    const bool complete = trace_all(std::move(first));
    state_.terminations = nullptr;
    return complete;
  }

  [[nodiscard]] const std::vector<Color>& radiance() const override { return state_.radiance; }
  [[nodiscard]] const std::vector<float>& omitted() const override { return state_.omitted; }
  [[nodiscard]] const std::vector<SampleSignature>& signatures() const override { return state_.signatures; }
  [[nodiscard]] const GBuffer& gbuffer() const override { return state_.gbuffer; }
  [[nodiscard]] const RenderStatistics& statistics() const override { return state_.statistics; }

 private:
  /// Limit of the rays waiting at once, over all bounces: 2^24 rays take about 2 GiB. Only a scene whose materials
  /// return more light than they receive, traced to a great depth, comes near.
  static constexpr std::size_t pending_rays_max = std::size_t{1} << 24;

  bool trace_all(BounceQueuesPtr first_bounce) {
    const std::size_t count = state_.batch.samples.size();
    state_.radiance.resize(count);
    std::fill(state_.radiance.begin(), state_.radiance.end(), Color{});  // inlined, unlike some assign()
    if (state_.may_omit_radiance()) state_.omitted.assign(count, 0);
    state_.media.reset();
    if (state_.writes_gbuffer()) state_.gbuffer.reset(count);
    state_.statistics.samples += count;
    state_.signatures.assign(state_.batch.sign ? count : 0, {});
    std::vector<BounceQueuesPtr> pending;
    pending.push_back(std::move(first_bounce));
    std::size_t pending_rays = pending.back()->size();
    while (!pending.empty()) {
      if (state_.control.cancelled()) return false;
      BounceQueuesPtr bounce = std::move(pending.back());
      pending.pop_back();
      if (bounce->size() > bounce_rays_max) {
        auto [first, second] = split(*bounce);
        pending.push_back(std::move(second));
        pending.push_back(std::move(first));
        continue;
      }
      BounceQueuesPtr next = acquire_queues(bounce->depth + 1);
      trace_bounce(*bounce, *next);
      pending_rays += next->size() - bounce->size();
      if (pending_rays > pending_rays_max) throw std::bad_alloc();
      release_queues(std::move(bounce));
      if (next->size() != 0) {
        pending.push_back(std::move(next));
      } else {
        release_queues(std::move(next));
      }
    }
    if (state_.scene.depth_cue && !state_.batch.x.empty()) apply_depth_cue();  // depth is that of the view
    for (const Color& sample : state_.radiance) state_.statistics.non_finite += finite(sample) ? 0 : 1;
    return !state_.control.cancelled();  // the last bounce may be incomplete
  }

  void apply_depth_cue() {
    const DepthCue& cue = *state_.scene.depth_cue;
    for (std::size_t sample = 0; sample < state_.radiance.size(); ++sample) {
      if (!state_.gbuffer.hit(sample) && state_.scene.output.alpha) continue;  // transparent
      const double scale = depth_cue_scale(cue, state_.gbuffer.depth[sample]);
      state_.radiance[sample] = state_.radiance[sample] * scale + cue.color * (1 - scale);
    }
  }

  /// Returns empty queues, with the memory of released ones if there are any.
  BounceQueuesPtr acquire_queues(std::uint32_t depth) {
    if (released_queues_.empty()) released_queues_.push_back(std::make_unique<BounceQueues>());
    BounceQueuesPtr queues = std::move(released_queues_.back());
    released_queues_.pop_back();
    queues->clear();
    queues->depth = depth;
    return queues;
  }

  /// Two bounces are in use at a time unless bounces are split, which is rare.
  void release_queues(BounceQueuesPtr queues) {
    if (released_queues_.size() < 2) released_queues_.push_back(std::move(queues));
  }

  void generate_camera_rays(RayQueue& rays) const {
    const auto& [samples, x, y, lens, share, light_points, sign, lifted] = state_.batch;
    const CompiledScene& scene = state_.scene;
    const std::size_t count = samples.size();
    const std::size_t eyes = scene.camera.is_anaglyph() ? 2 : 1;
    const CompiledCamera::CameraRaySpan all = rays.reset_to_camera_rays(eyes * count, MediumStack::camera(scene));
    if (eyes == 2) rays.split_channels();
    for (std::size_t eye = 0; eye < eyes; ++eye) {
      const CompiledCamera::CameraRaySpan to = all.from(eye * count);
      if (state_.template needs<&Requirements::lens>()) {
        for (std::size_t i = 0; i < count; ++i) to.put(i, scene.camera.generate_ray(x[i], y[i], lens[i], eye));
      } else {
        scene.camera.generate_rays(x.data(), y.data(), count, to, eye);
      }
    }
    if (state_.template needs<&Requirements::filtered_textures>())
      for (std::size_t i = 0; i < rays.size(); ++i)
        rays.set_cone(i, camera_cone(scene, rays.direction(i), share[rays.sample(i)]));
  }

  void trace_bounce(const BounceQueues& bounce, BounceQueues& next) {
    RayCounts& counts = state_.statistics.rays;
    counts.camera += bounce.camera.size();
    counts.reflection += bounce.reflection.size();
    counts.refraction += bounce.refraction.size();
    state_.termination = Termination(state_.scene.accuracy, state_.batch.lifted, next.depth);
    const Coherence coherence = bounce.depth == 0 ? Coherence::coherent : Coherence::incoherent;
    const auto trace_rays = [&](const RayQueue& queue) {
      if (queue.empty()) return;
      intersect(queue, bounce.depth, coherence);
      shade_hits(queue, bounce.depth, next);
      lighting_.shade(queue, bounce.depth, coherence);
    };
    for (const RayQueue* queue : {&bounce.camera, &bounce.reflection, &bounce.refraction}) trace_rays(*queue);
    if (!state_.template needs<&Requirements::global_light>()) return;
    counts.diffuse += bounce.diffuse.size();
    trace_rays(bounce.diffuse);
    counts.shadow += bounce.emission.size();
    if (!bounce.emission.empty()) add_emission(bounce.emission);
  }

  HitSpan find_hits(const RayQueue& rays, Coherence coherence) {
    const HitSpan found = state_.hits.resize_to_fit(rays.size());
    for_each_part(rays.span(), state_.control, [&](const RaySpan& part, std::size_t first) {
      state_.scene.accelerator->intersect(part, hits_from(found, first), coherence);
    });
    return found;
  }

  void intersect(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
    const std::size_t count = rays.size();
    const HitSpan found = find_hits(rays, coherence);
    std::vector<std::uint32_t>& hit_rays = state_.hit_rays;
    hit_rays.resize(count);
    escaped_rays_.resize(count);
    std::size_t hits = 0, escaped = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const bool hit = found.primitive[i].hit();
      hit_rays[hits] = escaped_rays_[escaped] = static_cast<std::uint32_t>(i);
      hits += hit ? 1 : 0;
      escaped += hit ? 0 : 1;
    }
    hit_rays.resize(hits);
    escaped_rays_.resize(escaped);
    if (!escaped_rays_.empty()) handle_escaped_rays(rays, depth);
    if (state_.writes_gbuffer() && depth == 0) write_gbuffer_depths(rays);
  }

  void write_gbuffer_depths(const RayQueue& rays) {
    const CompiledScene& scene = state_.scene;
    for (const std::uint32_t ray : state_.hit_rays)
      state_.gbuffer.depth[rays.sample(ray)] =
          scene.frame.world_from_render(scene.camera.depth(rays.direction(ray), state_.hits.t[ray]));
  }

  void handle_escaped_rays(const RayQueue& rays, std::uint32_t depth) {
    const CompiledScene& scene = state_.scene;
    if (depth == 0 && scene.output.alpha) return;  // transparent
    const Color* plain = scene.background->plain();
    if (plain != nullptr && is_black(*plain)) return;
    const bool weighs = state_.template needs<&Requirements::emitters>();
    if (plain != nullptr && !weighs && !state_.template needs<&Requirements::absorption>()) {
      for (const std::uint32_t ray : escaped_rays_) state_.radiance[rays.sample(ray)] += rays.throughput(ray) * *plain;
      return;
    }
    const bool filtered = state_.template needs<&Requirements::environment>() &&
                          state_.template needs<&Requirements::filtered_textures>();
    for (const std::uint32_t ray : escaped_rays_) {
      const double spread = filtered ? std::abs(rays.cone(ray).spread) : 0;
      Color radiance = plain != nullptr ? *plain : scene.background->radiance(rays.direction(ray), spread);
      if (weighs) radiance = radiance * weight_of_sky(rays, ray);
      state_.radiance[rays.sample(ray)] += state_.throughput_at_hit(rays, ray) * radiance;
    }
  }

  /// Weight of the sky that a ray finds, if rays toward emitters may have found it as well.
  [[nodiscard]] double weight_of_sky(const RayQueue& rays, std::size_t ray) const {
    const double own = rays.path_state(ray).density;
    return own == 0 ? 1
                    : own / (own + state_.scene.objects.emitters.density_of_sky(rays.origin(ray), rays.direction(ray)));
  }

  /// Loads up to 16 hits, from `first` on in `hit_rays`: all that does not depend on the light.
  void load_hits(const RayQueue& rays, std::size_t first, ShadingPointPacket& shading_points) {
    const std::vector<std::uint32_t>& hit_rays = state_.hit_rays;
    HitPacket& hit = state_.hit;
    const auto count = static_cast<int>(std::min<std::size_t>(lanes, hit_rays.size() - first));
    load(rays, state_.hits.span(), hit_rays.data() + first, count, hit, shading_points);
    if (state_.template needs<&Requirements::absorption>()) apply_absorption(rays);
    compute_points(state_.scene.geometry(), hit.ray_hits, hit.points);
    for (std::uint32_t i = 0; i < lanes; ++i) {
      shading_points.hit[i] = static_cast<std::uint32_t>(first) + i;
      hit.material[i] = state_.scene.objects.material[hit.points.object[i]];
    }
    if (hit.points.smooth) flatten_normals();
    orient_normals(hit, shading_points);
    gather_coefficients(state_.terms, hit);
    const bool transmits_light = state_.template needs<&Requirements::transmitted_light>();
    if (transmits_light) gather_far_side(state_.terms, hit);
    if (state_.spawns_secondary_rays() || transmits_light) secondary_.cross_media(shading_points);
    apply_throughput(hit, shading_points);
    if (state_.template needs<&Requirements::textures>() && hit.coefficients.textured != 0)
      textures_.apply_colors(rays, shading_points);
  }

  void shade_hits(const RayQueue& rays, std::uint32_t depth, BounceQueues& next) {
    HitPacket& hit = state_.hit;
    const CoefficientPacket& coefficients = hit.coefficients;
    const bool transmits_light = state_.template needs<&Requirements::transmitted_light>();
    const bool spawns = state_.spawns_secondary_rays(), writes = state_.writes_gbuffer() && depth == 0;
    const bool diffuses = state_.template needs<&Requirements::global_light>();
    const bool principled = state_.template needs<&Requirements::principled>();
    lighting_.reset();
    for (std::size_t first = 0; first < state_.hit_rays.size(); first += lanes) {
      ShadingPointPacket& shading_points = lighting_.append_packet();
      load_hits(rays, first, shading_points);
      if (state_.template needs<&Requirements::bump>() && coefficients.any_normal_map)
        textures_.perturb_normals(rays, shading_points, lighting_.unperturbed_normals());
      if (principled) {
        textures_.evaluate_principled(rays, shading_points);
        lighting_.add_principled();
      }
      if (coefficients.any_emitted)
        for (int i = 0; i < hit.count; ++i) state_.radiance[shading_points.sample[i]] += emission_of_lane(rays, i);
      if (writes) write_gbuffer(shading_points);
      if (!state_.signatures.empty()) sign(rays, depth, shading_points);
      lighting_.add_positions();
      if (diffuses || (spawns && (principled || (coefficients.reflects | coefficients.splits) != 0)))
        secondary_.spawn(rays, shading_points, next);
      if (transmits_light && coefficients.transmits_light != 0)
        lighting_.add_far_sides(rays, depth, shading_points,
                                [&](int lane) { return secondary_.far_side(shading_points, lane); });
      lighting_.move_to_vertices(rays, depth, shading_points);
    }
  }

  void sign(const RayQueue& rays, std::uint32_t depth, const ShadingPointPacket& shading_points) {
    const HitPacket& hit = state_.hit;
    for (int i = 0; i < hit.count; ++i) {
      SampleSignature& signature = state_.signatures[shading_points.sample[i]];
      const Vec3 normal = shading_points.normal[i], face = hit.points.face[i];
      const bool back = hit.back_face[i] > 0;
      std::uint64_t surface = mix(hit.points.object[i] * 2 + (back ? 1 : 0));
      const Vec3 outward = back ? -normal : normal;
      const bool flat =
          std::abs(dot(outward, face)) > 1 - 1e-12 && curvature_at(state_.scene, hit.ray_hits.primitive[i]) == 0;
      if (flat)
        surface = mix(surface ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(std::round(face.x * 8)) * 400 +
                                                           static_cast<std::int64_t>(std::round(face.y * 8)) * 20 +
                                                           static_cast<std::int64_t>(std::round(face.z * 8))));
      if (depth == 0) {
        signature.add_surface(static_cast<std::uint32_t>(surface >> 32), normal);
        if (state_.template needs<&Requirements::textures>() && hit.coefficients.textured != 0)
          textures_.sign(rays, shading_points, i, signature);
      } else {
        signature.add_secondary(surface ^ hit.path[i] * std::uint64_t{0x9e3779b97f4a7c15u});
      }
    }
  }

  /// Weight of the emission that a ray finds, if rays toward emitters may have found it as well.
  [[nodiscard]] double weight_of_emission(const RayQueue& rays, std::size_t ray, const PrimitiveRef& hit) const {
    if (!state_.template needs<&Requirements::emitters>()) return 1;
    const double own = rays.path_state(ray).density;
    if (own == 0) return 1;
    return own / (own + state_.scene.objects.emitters.density(hit, rays.origin(ray), rays.direction(ray)));
  }

  [[nodiscard]] Color emission_of_lane(const RayQueue& rays, int lane) const {
    const HitPacket& hit = state_.hit;
    return hit.emitted[lane] *
           weight_of_emission(rays, static_cast<std::size_t>(hit.ray[lane]), hit.ray_hits.primitive[lane]);
  }

  /// Adds the emission of emitters that are the first surface in the way of the rays.
  void add_emission(const RayQueue& rays) {
    const HitSpan found = find_hits(rays, Coherence::incoherent);
    std::vector<std::uint32_t>& hit_rays = state_.hit_rays;
    hit_rays.clear();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const PrimitiveRef hit = found.primitive[i];
      const PathState& path = rays.path_state(i);
      const auto is_sampled = [&] {  // else the light of patches includes it
        const Emitters& emitters = state_.scene.objects.emitters;
        return (hit.hit() ? emitters.density(hit, rays.origin(i), rays.direction(i))
                          : emitters.density_of_sky(rays.origin(i), rays.direction(i))) > 0;
      };
      if (path.density > 0 ? !is_sampled() : hit != path.emitter) continue;
      if (!hit.hit()) {
        const Color radiance = state_.scene.background->radiance(rays.direction(i), 0) * weight_of_sky(rays, i);
        state_.radiance[rays.sample(i)] += state_.throughput_at_hit(rays, i) * radiance;
        continue;
      }
      const CompiledScene& scene = state_.scene;
      const CompiledMaterial& material = state_.terms[scene.objects.material[scene.geometry().object_of(hit)]];
      if (material.textured) {
        hit_rays.push_back(static_cast<std::uint32_t>(i));
      } else {
        const Color radiance = state_.throughput_at_hit(rays, i) * material.emitted_ambient;
        state_.radiance[rays.sample(i)] += radiance * weight_of_emission(rays, i, hit);
      }
    }
    ShadingPointPacket shading_points;
    for (std::size_t first = 0; first < hit_rays.size(); first += lanes) {
      load_hits(rays, first, shading_points);
      for (int i = 0; i < state_.hit.count; ++i) state_.radiance[shading_points.sample[i]] += emission_of_lane(rays, i);
    }
  }

  void apply_absorption(const RayQueue& rays) {
    HitPacket& hit = state_.hit;
    for (int i = 0; i < lanes; ++i)
      hit.throughput.set(i, state_.throughput_at_hit(rays, static_cast<std::size_t>(hit.ray[i])));
  }

  /// Flat shading: replaces the normals by those of the faces.
  void flatten_normals() {
    PointPacket& p = state_.hit.points;
    const Approximations::Shading shading = state_.approximate().shading;
    if (shading == Approximations::Shading::flat) p.smooth = false;
    for (int i = 0; i < lanes; ++i) {
      if (!has_face_normals(shading_of(state_.material_of_lane(i).shading, shading))) continue;
      p.normal.set(i, p.face[i]);
      p.offset.set(i, {});
    }
  }

  void write_gbuffer(const ShadingPointPacket& shading_points) {
    GBuffer& gbuffer = state_.gbuffer;
    for_each_lane(first_lanes(state_.hit.count) & ~secondary_.nested_boundary(), [&](int i) {
      const std::uint32_t sample = shading_points.sample[i];
      gbuffer.normal[sample] = shading_points.normal[i];
      gbuffer.albedo[sample] = textures_.color_of_lane(i);
      gbuffer.object[sample] = state_.hit.points.object[i];
    });
  }

  WavefrontState<Features> state_;
  std::vector<std::uint32_t> escaped_rays_;  ///< rays of the queue that hit no surface
  TextureLookup<Features> textures_;
  DirectLighting<Features> lighting_;
  SecondaryRays<Features> secondary_;
  std::vector<BounceQueuesPtr> released_queues_;  ///< kept for their memory
};

extern template class Wavefront<WhittedFeatures>;
extern template class Wavefront<LocalFeatures>;
extern template class Wavefront<AllFeatures>;

}  // namespace tracer
