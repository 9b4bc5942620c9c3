#pragma once
/// Visibility of a light from all points of a surface patch.

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Points of a light, unless it is directional.
AffineVec light_points(const CompiledLight& light);

/// Primitives that may lie between a surface patch and a light: parts of the patch need to test no others.
struct Occluders {
  static constexpr std::size_t primitives_max = 64;

  enum class State : std::uint8_t {
    unknown,  ///< too many
    some,     ///< at most `primitives`
    lit,      ///< none, from any point of the patch
    dark      ///< the light adds nothing at any point of the patch
  };
  State state = State::unknown;
  std::uint8_t count = 0;
  std::array<PrimitiveRef, primitives_max> primitives;
};

/// Range of the fraction of the light that arrives: [1, 1] if nothing lies between (an empty shaft), [0, 0] if one
/// opaque primitive blocks all segments or the light is behind the surface, else from 0 on. `known` are occluders of a
/// patch that contains this one; `found`, unless null, receives those of this one.
Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light,
                      const Occluders& known, Occluders* found);

}  // namespace tracer
