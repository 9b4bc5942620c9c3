#pragma once
/// What the camera rays of a batch hit, where something is asked of that: depth cue, alpha, layers.

#include <limits>
#include <vector>

#include "tracer/src/math/vec.h"

namespace tracer {

/// Beside the batch's samples. A surface hidden within a solid of higher priority is hit, but has no normal, colour or
/// object.
struct GBuffer {
  static constexpr double nothing = std::numeric_limits<double>::infinity();
  static constexpr std::uint32_t no_object = std::numeric_limits<std::uint32_t>::max();

  std::vector<double> depth;  ///< world, along the viewing axis; `nothing` where nothing is hit
  std::vector<Vec3> normal;   ///< unit, towards the camera
  std::vector<Color> albedo;  ///< C of the material
  std::vector<std::uint32_t> object;

  void reset(std::size_t samples) {
    depth.assign(samples, nothing);
    normal.assign(samples, Vec3{});
    albedo.assign(samples, Color{});
    object.assign(samples, no_object);
  }
  [[nodiscard]] bool hit(std::size_t sample) const { return depth[sample] != nothing; }
};

/// How much of the radiance of what lies at depth z is left.
inline double depth_cue_scale(const DepthCue& cue, double z) {
  if (z <= cue.front) return cue.front_scale;
  if (!(z < cue.back)) return cue.back_scale;
  const double towards_back = (z - cue.front) / (cue.back - cue.front);
  return cue.front_scale + (cue.back_scale - cue.front_scale) * towards_back;
}

}  // namespace tracer
