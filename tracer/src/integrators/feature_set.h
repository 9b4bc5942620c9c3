#pragma once
/// What an instantiation of the integrator can model. It is compiled without the rest, which then costs nothing; of
/// what it holds, the scene's requirements decide at run time. Images are the same bits whichever is chosen.

#include <algorithm>
#include <iterator>

#include "tracer/requirements.h"

namespace tracer {

/// Everything.
struct FullModel {
  static constexpr bool holds(bool Requirements::* /*need*/) { return true; }
};

/// Whitted's own: mirrors, glass, sharp shadows, the local models on untextured surfaces.
struct ClassicModel {
  static constexpr bool holds(bool Requirements::*need) {
    using R = Requirements;
    for (bool R::*held : {&R::reflection, &R::refraction, &R::fresnel, &R::shadows, &R::transmissive_shadows,
                          &R::smooth_normals, &R::triangles, &R::spheres, &R::quadrics, &R::planes})
      if (need == held) return true;
    return false;
  }
};

/// Whether the model has all that is needed.
template <class Model>
bool suffices(const Requirements& needs) {
  return std::all_of(std::begin(requirement_names), std::end(requirement_names),
                     [&](const RequirementName& name) { return !(needs.*name.needed) || Model::holds(name.needed); });
}

}  // namespace tracer
