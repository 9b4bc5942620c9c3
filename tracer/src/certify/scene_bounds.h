#pragma once
/// Properties of a scene that bounds of its pixels share: boxes of primitives, ranges of textures and radiance.

#include <vector>

#include "tracer/src/certify/box_tree.h"
#include "tracer/src/certify/color_range.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

struct SceneBounds {
  /// The scene must outlive it. Throws std::bad_alloc.
  SceneBounds(const CompiledScene& compiled, const Approximations& approximations, const RenderControl& control);

  const CompiledScene& scene;
  BoxTree tree;
  std::vector<ColorInterval> textures;  ///< by texture
  /// Bound for any ray; may be infinite, and is under global light: a path that Russian roulette keeps may be brighter
  /// than any radiance.
  double radiance_max = 0;
  double transmittance_max = 1;  ///< bound for any shadow ray
  struct SecondaryMax {
    Color reflectance;  ///< with the diffuse part under global light
    Color transmittance;
  };
  std::vector<SecondaryMax> secondary_max;  ///< by material: bounds over its textures
  ColorInterval background{};               ///< radiance of rays that escape, over all directions
  Approximations approximate;               ///< any of them may darken or brighten any direct light
  bool outside_absorbs = false;             ///< the outside may absorb any part of the light
  bool in_medium = false;                   ///< the medium of the camera may absorb any part of the radiance
  bool overlapping_media = false;

  /// Radiance along any ray.
  [[nodiscard]] ColorInterval any_radiance() const {
    const Interval channel{0, radiance_max};
    return {channel, channel, channel};
  }
};

}  // namespace tracer
