#pragma once
/// The Whitted integrator as a wavefront: a batch of samples is traced bounce by bounce. A queue of rays is
/// intersected, its hits are shaded in packets of 16, and the secondary rays fill the queues of the next bounce. There
/// is no recursion, so that depth alone costs no memory.

#include <vector>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"
#include "tracer/src/integrators/whitted/secondary_rays.h"
#include "tracer/src/integrators/whitted/texture_lookup.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace tracer {

/// Models Tracer. Contributions to one sample are added in an order that depends on that sample alone (bounce, then
/// kind, then the order of the parents, then light), so that no choice of batch, tile or thread changes a bit of the
/// image.
template <class Features>
class Wavefront {
 public:
  Wavefront(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : state_(scene, control, approximations), textures_(state_), lighting_(state_), secondary_(state_) {}
  Wavefront(const Wavefront&) = delete;
  Wavefront& operator=(const Wavefront&) = delete;

  [[nodiscard]] Batch& batch() { return state_.batch; }
  bool trace();

  [[nodiscard]] const std::vector<Color>& radiance() const { return state_.radiance; }
  [[nodiscard]] const std::vector<OmittedRadiance>& omitted() const { return state_.omitted; }
  [[nodiscard]] const GBuffer& gbuffer() const { return state_.gbuffer; }
  [[nodiscard]] const RenderStatistics& statistics() const { return state_.statistics; }

 private:
  BounceQueues acquire_queues(std::uint32_t depth);
  void release_queues(BounceQueues queues);
  void generate_camera_rays(RayQueue& rays) const;
  void trace_bounce(const BounceQueues& bounce, BounceQueues& next);
  void process_queue(const RayQueue& rays, std::uint32_t depth, BounceQueues& next);
  void intersect(const RayQueue& rays, std::uint32_t depth, Coherence coherence);
  void handle_escaped_rays(const RayQueue& rays, std::uint32_t depth);
  void shade_hits(const RayQueue& rays, std::uint32_t depth, BounceQueues& next);
  void apply_absorption(const RayQueue& rays);
  void flatten_normals();
  void write_gbuffer(const ShadingPointPacket& shading_points);

  WavefrontState<Features> state_;
  std::vector<std::uint32_t> escaped_rays_;  ///< rays of the queue that hit no surface
  TextureLookup<Features> textures_;
  DirectLighting<Features> lighting_;
  SecondaryRays<Features> secondary_;
  std::vector<BounceQueues> released_queues_;  ///< kept for their memory
};

}  // namespace tracer
