#pragma once
/// Rays from surfaces to one light: which of them arrive, and with how much of their light.

#include <vector>

#include "tracer/src/integrator/arrival.h"
#include "tracer/src/integrator/hits.h"
#include "tracer/src/integrator/media.h"
#include "tracer/src/integrator/ray_queue.h"

namespace tracer {

class ShadowRays {
 public:
  ShadowRays(const CompiledScene& scene, const RenderControl& control, const Requirements& needs)
      : scene_(scene), control_(control), needs_(needs) {}

  void clear() { rays_.clear(); }
  /// The lanes of `packet` at which light arrives.
  void append(const FacingPacket& packet, const Arrival& a);
  [[nodiscard]] std::size_t size() const { return rays_.size(); }

  /// Traces them all and adds what arrives, in the order they were pushed.
  void add_to(std::vector<Color>& radiance, Media& media, Coherence coherence);

 private:
  void cross_transmissive(Media& media);
  void cross(std::size_t i, const Hit& hit, Media& media);

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Requirements& needs_;
  RayQueue rays_;
  std::vector<double> distance_;  ///< beside rays_, and some more
  std::vector<std::uint8_t> blocked_;
  std::vector<Color> visible_;  ///< S_i: product over the surfaces crossed

  // Those on their way through transmissive surfaces, and the next step's.
  RayQueue crossing_, next_;  ///< `sample` is the shadow ray's number
  std::vector<double> crossing_distance_, next_distance_;
  Hits crossed_;
};

}  // namespace tracer
