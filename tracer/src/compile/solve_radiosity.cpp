#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/radiosity/transport.h"

namespace tracer {
namespace {

constexpr double patches_min = 300;
constexpr double patches_max = 16'384;  ///< their rows take up to 150 MB
constexpr std::uint32_t row_rays = 256;
constexpr std::size_t patch_points_max = 64;
constexpr std::uint32_t sweeps_max = 1000;

/// Infinite planes are divided as far as three radii of everything else.
Region region_of(const CompiledScene& scene, const Bounds& finite) {
  const Vec3 low = scene.frame.render_from_world(finite.low), high = scene.frame.render_from_world(finite.high);
  const double radius = length(high - low) * 0.5;
  return {(low + high) * 0.5, scene.geometry().planes.point.empty() ? radius : 3 * radius};
}

/// More patches for smaller target errors: the error of a Cornell box falls with the power 0.4 of their number, and
/// with 12,000 it leaves half of a target of 1 level to the sampling.
double wanted_patches(const Accuracy& accuracy) {
  return std::clamp(12'000 * std::pow(accuracy.target().value_or(2), -2.5), patches_min, patches_max);
}

/// The points of each patch, at most patch_points_max.
std::vector<std::vector<PatchPoint>> divide(const CompiledScene& scene, const Region& region, PatchGrid& patches,
                                            const RenderControl& control) {
  constexpr double points_per_patch = 16, lines_max = 1u << 22;
  const double wanted = wanted_patches(scene.accuracy);
  const PatchPoints surfaces(scene, region, control);
  if (!(surfaces.per_line() > 0)) return {};
  const double side = std::sqrt(surfaces.per_line() * 2 * std::numbers::pi / wanted) * region.radius;
  patches = PatchGrid(side);
  const double lines = std::min(std::ceil(wanted * points_per_patch / surfaces.per_line()), lines_max);
  std::vector<std::vector<PatchPoint>> points;
  for (const PatchPoint& at : surfaces.on_lines(static_cast<std::uint32_t>(lines), side * 0x1p-6)) {
    const std::uint32_t patch = patches.insert(at.object, offset_origin(at.point, at.outward, at.outward), at.normal);
    if (patch == points.size()) points.emplace_back();
    if (points[patch].size() < patch_points_max) points[patch].push_back(at);
  }
  return points;
}

/// Rays of a row start at the points in turn, in directions distributed as the cosine.
class RowRays {
 public:
  RowRays(const CompiledScene& scene, Batch& batch) : scene_(scene), batch_(batch) { batch.clear(); }

  void add(std::uint32_t patch, const std::vector<PatchPoint>& points) {
    const std::uint64_t key = pixel_key(patch, ~scene_.accuracy.seed);
    for (std::uint32_t ray = 0; ray < row_rays; ++ray) {
      const auto sample = static_cast<std::uint32_t>(batch_.samples.size());
      batch_.samples.push_back({key, ray});
      const PatchPoint& at = points[ray % points.size()];
      const Vec3 local = cosine_direction(shuffled_point(ray, mix(key)));
      const Axes axes = axes_about(at.normal);
      const Vec3 direction = unit(axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
      if (!(dot(direction, at.outward) > 0)) continue;  // brings nothing
      rays_.push(offset_origin(at.point, at.outward, at.outward), direction, {1, 1, 1}, sample, {}, 1,
                 MediumStack::outside);
      // Emitters that are sampled light the place of the image itself: such a ray must not bring their light.
      const double density = scene_.needs.emitters ? std::numeric_limits<double>::min() : 0;
      rays_.set_path_state(rays_.size() - 1, {.weight = 1, .density = density});
      if (scene_.needs.filtered_textures) rays_.set_cone({});
    }
  }
  [[nodiscard]] const RayQueue& rays() const { return rays_; }

 private:
  const CompiledScene& scene_;
  Batch& batch_;
  RayQueue rays_;
};

struct Row {
  Color source;
  std::vector<TransportEntry> entries;
};

/// The rows of the patches from `first` on.
void trace_rows(const CompiledScene& scene, const std::vector<std::vector<PatchPoint>>& points, std::size_t first,
                Wavefront<AllFeatures>& tracer, std::span<Row> rows) {
  RowRays rays(scene, tracer.batch());
  for (std::size_t i = 0; i < rows.size(); ++i) rays.add(static_cast<std::uint32_t>(first + i), points[first + i]);
  std::vector<Landing> landings;
  if (!tracer.trace_from_patches(rays.rays(), landings)) return;
  constexpr double share = 1.0 / row_rays;
  for (std::size_t sample = 0; sample < tracer.radiance().size(); ++sample)
    if (finite(tracer.radiance()[sample])) rows[sample / row_rays].source += tracer.radiance()[sample] * share;
  for (const Landing& landing : landings)
    rows[landing.sample / row_rays].entries.push_back({landing.entry.patch, landing.entry.share * share});
}

}  // namespace

std::shared_ptr<const Radiosity> solve_radiosity(CompiledScene& scene, const Bounds& finite,
                                                 const RenderControl& control) {
  constexpr double tolerance = 1e-5;
  constexpr std::size_t block = 16;
  const auto radiosity = std::make_shared<Radiosity>();
  const Region region = region_of(scene, finite);
  if (!(region.radius > 0)) return nullptr;
  const std::vector<std::vector<PatchPoint>> points = divide(scene, region, radiosity->patches, control);
  if (points.empty()) return nullptr;
  scene.objects.radiosity = radiosity;  // rows need the patches
  std::vector<Row> rows(points.size());
  TracerPool<Wavefront<AllFeatures>> pool(scene, control, scene.accuracy.approximate);
  for_each_tile((rows.size() + block - 1) / block, 0, [&](std::uint64_t number) {
    if (control.cancelled()) return;
    const std::size_t first = number * block;
    typename TracerPool<Wavefront<AllFeatures>>::Lease tracer(pool);
    trace_rows(scene, points, first, *tracer, std::span(rows).subspan(first, std::min(block, rows.size() - first)));
  });
  Transport transport;
  for (Row& row : rows) transport.add_row(row.source, std::move(row.entries));
  TransportSolution solution = solve(transport, tolerance, sweeps_max, control);
  radiosity->arriving = std::move(solution.values);
  radiosity->figures = {static_cast<std::uint32_t>(rows.size()), pool.statistics().rays.total(), transport.entries(),
                        solution.sweeps, solution.bound};
  return radiosity;
}

}  // namespace tracer
