#include <algorithm>
#include <bit>
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

/// Patches and rays by the target error. Of the squared error of a Cornell box, in levels, the size of n patches causes
/// 750 / n and chance 640 / r^1.5 for r rays in each row: together a quarter of the square of a target of 1. The rest
/// is left to the sampling, and to scenes with more contrast, which get more patches for larger targets, since these
/// are cheap.
struct Effort {
  double patches;
  std::uint32_t row_rays;
  explicit Effort(const Accuracy& accuracy) {
    constexpr double patches_min = 300, patches_of_level = 4000, row_rays_of_level = 512;
    constexpr std::uint32_t row_rays_min = 64, row_rays_max = 512;  // a row takes up to 32 bytes for each
    const double target = accuracy.target().value_or(2);
    patches = std::max(patches_of_level / std::min(target, target * target), patches_min);
    const double rays = std::min<double>(row_rays_of_level * std::pow(target, -4.0 / 3), row_rays_max);
    row_rays = std::max(std::bit_ceil(static_cast<std::uint32_t>(rays)), row_rays_min);  // stratified best
  }
};

}  // namespace

std::shared_ptr<const Radiosity> solve_radiosity(CompiledScene& scene, const Bounds& finite,
                                                 const RenderControl& control) {
  constexpr double tolerance = 1e-5;
  constexpr std::uint32_t sweeps_max = 1000;
  const Region region = region_of(scene, finite);
  if (!(region.radius > 0)) return nullptr;
  const Effort effort(scene.accuracy);
  SurfacePatches patches = divide_surfaces(scene, region, effort.patches, Limits{}.radiosity_patches, control);
  if (patches.points.empty()) return nullptr;
  const auto radiosity = std::make_shared<Radiosity>();
  radiosity->patches = std::move(patches.grid);
  scene.objects.radiosity = radiosity;  // rows need the patches
  const auto [transport, rays] = trace_rows(scene, patches.points, effort.row_rays, control);
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
