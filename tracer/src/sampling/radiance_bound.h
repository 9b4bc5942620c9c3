#pragma once
/// How bright any ray of a scene can be, and so what a branch that is not traced can hide.

#include <optional>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// An upper bound of the radiance along any ray, every channel: the least L with L >= L_background and, for every
/// material m, L >= E_m + rho_m L, where E_m bounds what its local model gives and rho_m what it passes on:
/// L = max(L_background, max_m E_m / (1 - rho_m)). None where that has no solution: a light whose attenuation is not
/// bounded shines on something, or a material gives light of its own and passes on all it receives.
std::optional<double> radiance_bound(const CompiledScene& scene);

}  // namespace tracer
