#pragma once
/// Feature sets of an integrator. An instantiation is compiled for the features of its set; the scene's requirements
/// select among these at run time. Images are bit-identical for every set that supports the scene.

#include <algorithm>
#include <iterator>

#include "tracer/requirements.h"

namespace tracer {

struct AllFeatures {
  static constexpr bool includes(bool Requirements::* /*feature*/) { return true; }
};

/// Features of Whitted 1980: mirrors, glass, hard shadows and local shading models on untextured surfaces.
struct WhittedFeatures {
  static constexpr bool includes(bool Requirements::*feature) {
    using R = Requirements;
    for (bool R::*included : {&R::reflection, &R::refraction, &R::fresnel, &R::shadows, &R::transmissive_shadows,
                              &R::smooth_normals, &R::triangles, &R::spheres, &R::quadrics, &R::planes})
      if (feature == included) return true;
    return false;
  }
};

/// True if the set includes every required feature.
template <class Features>
bool supports(const Requirements& needs) {
  return std::all_of(std::begin(requirement_names), std::end(requirement_names), [&](const RequirementName& name) {
    return !(needs.*name.needed) || Features::includes(name.needed);
  });
}

}  // namespace tracer
