#pragma once
/// Shadow rays from shading points to one light, and their transmittance.

#include <vector>

#include "tracer/src/compiled/medium_stack.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/integrators/whitted/intersection_packet.h"
#include "tracer/src/integrators/whitted/light_samples.h"

namespace tracer {

class ShadowRays {
 public:
  ShadowRays(const CompiledScene& scene, const RenderControl& control, const Requirements& needs)
      : scene_(scene), control_(control), needs_(needs) {}

  void clear() { rays_.clear(); }
  /// Appends the lit lanes of `packet`.
  void append(const ShadingPointPacket& packet, const LightSamplePacket& sample);
  [[nodiscard]] std::size_t size() const { return rays_.size(); }

  /// Traces all rays and adds their radiance to the samples, in the order of append().
  void add_unoccluded(std::vector<Color>& radiance, MediumStack& media, Coherence coherence);

 private:
  /// Remaining parts of shadow rays. `number`: index of the shadow ray.
  struct RaySegments {
    const RayQueue& rays;
    const double* distance;
    const std::uint32_t* number;
  };

  void attenuate_transmissive(MediumStack& media);
  void cross_next_surface(const RaySegments& from, MediumStack& media);
  void cross_packet(const RaySegments& from, MediumStack& media);

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Requirements& needs_;
  RayQueue rays_;
  std::vector<double> distance_;  ///< parallel to rays_, possibly longer
  std::vector<std::uint8_t> blocked_;
  std::vector<Color> transmittance_;   ///< S_i: product over the crossed surfaces
  std::vector<std::uint32_t> number_;  ///< 0, 1, ...

  // Segments behind a transmissive surface, and those of the next step.
  RayQueue crossing_, next_;  ///< `sample` is the shadow ray's number
  std::vector<double> crossing_distance_, next_distance_;
  Hits crossed_;
  std::vector<std::uint32_t> hit_rays_;  ///< rays that crossed a surface; possibly longer
  IntersectionPacket intersections_;
};

}  // namespace tracer
