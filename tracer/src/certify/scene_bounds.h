#pragma once
/// Properties of a scene that bounds of its pixels share.

#include <array>
#include <vector>

#include "tracer/src/certify/affine_form.h"
#include "tracer/src/certify/box_tree.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Ranges of the channels of a color.
using ColorInterval = std::array<Interval, 3>;

inline ColorInterval interval_of(const Color& color) {
  return {{{color.r, color.r}, {color.g, color.g}, {color.b, color.b}}};
}
inline ColorInterval hull(const ColorInterval& a, const ColorInterval& b) {
  return {hull(a[0], b[0]), hull(a[1], b[1]), hull(a[2], b[2])};
}

/// Sum of two terms, with room for the rounding of further ones in the integrator if the second is not black.
inline Interval sum(const Interval& own, const Interval& added) {
  if (!(added.high > 0)) return own;
  return {(own.low + added.low) * (1 - 0x1p-40), (own.high + added.high) * (1 + 0x1p-40)};
}

struct SceneBounds {
  /// The scene must outlive it. Incomplete after cancellation. Throws std::bad_alloc.
  SceneBounds(const CompiledScene& compiled, const RenderControl& control);

  /// A material, over all values of its textures.
  struct MaterialRange {
    ColorInterval emitted_ambient, diffuse, specular;
    std::array<double, 3> other_max{};  ///< bound of light through the surface and of secondary rays
    ColorInterval anywhere{};           ///< radiance at any point of a surface
    bool has_normal = true;             ///< false: textures turn it, or triangles are lit at their vertices
    bool may_be_hidden = false;         ///< a solid of higher priority replaces the surface
  };

  const CompiledScene& scene;
  BoxTree tree;
  /// Bound for any ray; may be infinite, and is under global light: a path that Russian roulette keeps may be brighter
  /// than any radiance.
  double radiance_max = 0;
  double transmittance_max = 1;  ///< bound for any shadow ray
  std::vector<MaterialRange> materials;
  ColorInterval background{};    ///< radiance of rays that escape, over all directions
  bool outside_absorbs = false;  ///< the outside may absorb any part of the light
  bool in_medium = false;        ///< the medium of the camera may absorb any part of the radiance
  bool culls = false;            ///< the integrator may cull lights

  [[nodiscard]] ColorInterval any_radiance() const {
    const Interval channel{0, radiance_max};
    return {channel, channel, channel};
  }
};

}  // namespace tracer
