#include <algorithm>
#include <cmath>

#include "tracer/limits.h"
#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/compile/surface_rows.h"

namespace tracer {
namespace {

/// Infinite planes are divided as far as three radii of everything else.
Region region_of(const CompiledScene& scene, const Bounds& finite) {
  const Vec3 low = scene.frame.render_from_world(finite.low), high = scene.frame.render_from_world(finite.high);
  const double radius = length(high - low) * 0.5;
  return {(low + high) * 0.5, scene.geometry().planes.point.empty() ? radius : 3 * radius};
}

/// More patches for smaller target errors: the error of a Cornell box falls with the power 0.4 of their number, and
/// with 12,000 it leaves half of a target of 1 level to the sampling.
double wanted_patches(const Accuracy& accuracy) {
  constexpr double patches_min = 300;
  return std::max(12'000 * std::pow(accuracy.target().value_or(2), -2.5), patches_min);
}

}  // namespace

std::shared_ptr<const Radiosity> solve_radiosity(CompiledScene& scene, const Bounds& finite,
                                                 const RenderControl& control) {
  constexpr double tolerance = 1e-5;
  constexpr std::uint32_t sweeps_max = 1000;
  const Region region = region_of(scene, finite);
  if (!(region.radius > 0)) return nullptr;
  SurfacePatches patches =
      divide_surfaces(scene, region, wanted_patches(scene.accuracy), Limits{}.radiosity_patches, control);
  if (patches.points.empty()) return nullptr;
  const auto radiosity = std::make_shared<Radiosity>();
  radiosity->patches = std::move(patches.grid);
  scene.objects.radiosity = radiosity;  // rows need the patches
  const auto [transport, rays] = trace_rows(scene, patches.points, control);
  TransportSolution solution = solve(transport, tolerance, sweeps_max, control);
  radiosity->arriving = std::move(solution.values);
  radiosity->figures = {static_cast<std::uint32_t>(patches.points.size()),
                        patches.limited,
                        rays,
                        transport.entries(),
                        solution.sweeps,
                        solution.bound};
  return radiosity;
}

}  // namespace tracer
