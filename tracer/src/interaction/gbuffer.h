#pragma once
/// First hits of the camera rays of a batch, for depth cue, alpha and layers.

#include <limits>
#include <vector>

#include "tracer/src/math/vec.h"

namespace tracer {

/// Parallel to the batch's samples. A surface within a solid of higher priority is a hit, but has no normal, color or
/// object.
struct GBuffer {
  static constexpr double no_hit = std::numeric_limits<double>::infinity();
  static constexpr std::uint32_t no_object = std::numeric_limits<std::uint32_t>::max();

  std::vector<double> depth;  ///< world space, along the viewing axis; `no_hit` for escaped rays
  std::vector<Vec3> normal;   ///< unit, towards the camera
  std::vector<Color> albedo;  ///< C of the material
  std::vector<std::uint32_t> object;

  void reset(std::size_t samples) {
    depth.assign(samples, no_hit);
    normal.assign(samples, Vec3{});
    albedo.assign(samples, Color{});
    object.assign(samples, no_object);
  }
  [[nodiscard]] bool hit(std::size_t sample) const { return depth[sample] != no_hit; }
};

/// Factor of the radiance at depth z.
inline double depth_cue_scale(const DepthCue& cue, double z) {
  if (z <= cue.front) return cue.front_scale;
  if (!(z < cue.back)) return cue.back_scale;
  const double towards_back = (z - cue.front) / (cue.back - cue.front);
  return cue.front_scale + (cue.back_scale - cue.front_scale) * towards_back;
}

}  // namespace tracer
