#pragma once
/// Finds probable errors in a scene that can be rendered.

#include <cstddef>
#include <vector>

#include "tracer/scene.h"
#include "tracer/validate.h"

namespace tracer {

inline constexpr std::size_t warnings_max = 100;

/// The first `warnings_max` warnings, with the codes "color_above_1", "radians", "nothing_lit", "nothing_in_view",
/// "behind_camera", "light_enclosed", "camera_enclosed", "light_too_faint", "emission_lights_nothing",
/// "highlight_omitted", "energy_gain", "beyond_precision" and "many_secondary_rays" (api/docs/scene.md). Precondition:
/// validate() accepts the scene. The meshes of files may be empty: they count as visible. Time is linear in the placed
/// objects and vertices. Never fails.
std::vector<Issue> warnings(const Scene& scene);

/// Mean rays of the tree of a camera ray at the first 256 surfaces that reflect, at most 1e9, predicted from sizes and
/// distances: within a factor of ten up to some thousands. Precondition and time as above.
double predicted_rays(const Scene& scene);

}  // namespace tracer
