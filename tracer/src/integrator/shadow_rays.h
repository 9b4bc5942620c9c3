#pragma once
/// Rays from surfaces to one light: which of them arrive, and with how much of their light.

#include <vector>

#include "tracer/src/integrator/hits.h"
#include "tracer/src/integrator/media.h"
#include "tracer/src/integrator/ray_queue.h"

namespace tracer {

class ShadowRays {
 public:
  ShadowRays(const CompiledScene& scene, const RenderControl& control, const Requirements& needs)
      : scene_(scene), control_(control), needs_(needs) {}

  void clear() {
    rays_.clear();
    distance_.clear();
  }
  /// `light` is what `sample` gains if nothing is in the way.
  void push(const Vec3& origin, const Vec3& direction, double distance, const Color& light, std::uint32_t sample,
            PrimitiveRef from, Media::List media) {
    rays_.push(origin, direction, light, sample, from, 0, media);
    // Short of the light by more than the rounding of its distance, so that what a light sits on does not hide it.
    distance_.push_back(distance * (1 - 0x1p-40));
  }
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
  std::vector<double> distance_;
  std::vector<std::uint8_t> blocked_;
  std::vector<Color> visible_;  ///< S_i: product over the surfaces crossed

  // Those on their way through transmissive surfaces, and the next step's.
  RayQueue crossing_, next_;  ///< `sample` is the shadow ray's number
  std::vector<double> crossing_distance_, next_distance_;
  Hits crossed_;
};

}  // namespace tracer
