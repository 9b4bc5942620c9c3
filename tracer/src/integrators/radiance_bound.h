#pragma once
/// Upper bound of the radiance in a scene.

#include <optional>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Upper bound of the radiance along any ray of a path from the camera, and so of the radiance along an omitted ray.
///
/// The least L with L >= L_background and L >= E_m + rho_m L for every material m, in every channel, where E_m bounds
/// the local shading and rho_m the albedo for secondary rays, with that of diffuse reflection under global light: L =
/// max(L_background, max_m E_m / (1 - rho_m)), for the materials of objects. None if there is no solution: a light with
/// unbounded attenuation, or an emissive material with albedo 1.
std::optional<double> radiance_bound(const CompiledScene& scene);

}  // namespace tracer
