#pragma once
/// Rays from surfaces to one light: which of them arrive, and with how much of their light.

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
  /// The lanes of `packet` at which light arrives.
  void append(const ShadingPointPacket& packet, const LightSamplePacket& a);
  [[nodiscard]] std::size_t size() const { return rays_.size(); }

  /// Traces them all and adds what arrives, in the order they were pushed.
  void add_to(std::vector<Color>& radiance, MediumStack& media, Coherence coherence);

 private:
  /// Rays on their way, and the shadow rays' numbers.
  struct OnTheWay {
    const RayQueue& rays;
    const double* distance;
    const std::uint32_t* number;
  };

  void cross_transmissive(MediumStack& media);
  void cross_one_each(const OnTheWay& from, MediumStack& media);
  void cross_packet(const OnTheWay& from, MediumStack& media);

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Requirements& needs_;
  RayQueue rays_;
  std::vector<double> distance_;  ///< beside rays_, and some more
  std::vector<std::uint8_t> blocked_;
  std::vector<Color> visible_;         ///< S_i: product over the surfaces crossed
  std::vector<std::uint32_t> number_;  ///< 0, 1, ...

  // Those that crossed a transmissive surface and go on, and the next step's.
  RayQueue crossing_, next_;  ///< `sample` is the shadow ray's number
  std::vector<double> crossing_distance_, next_distance_;
  Hits crossed_;
  std::vector<std::uint32_t> met_;  ///< which of the rays crossed something, and some more
  IntersectionPacket places_;       ///< a packet of these
};

}  // namespace tracer
