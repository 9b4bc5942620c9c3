#include "tracer/src/compile/surface_rows.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::size_t points_of_patch_max = 64;

/// Rays of a row start at the points in turn, in directions distributed as the cosine.
class RowRays {
 public:
  RowRays(const CompiledScene& scene, Batch& batch, std::uint32_t row_rays)
      : scene_(scene), batch_(batch), row_rays_(row_rays) {
    batch.clear();
  }

  void add(std::uint32_t patch, const std::vector<PatchPoint>& points) {
    const std::uint64_t key = pixel_key(patch, ~scene_.accuracy.seed);
    for (std::uint32_t ray = 0; ray < row_rays_; ++ray) {
      const auto sample = static_cast<std::uint32_t>(batch_.samples.size());
      batch_.samples.push_back({key, ray});
      const PatchPoint& at = points[ray % points.size()];
      const Vec3 direction = diffuse_direction(at.normal, shuffled_point(ray, mix(key)));
      if (!(dot(direction, at.outward) > 0)) continue;  // brings nothing
      rays_.push(offset_origin(at.point, at.outward, at.outward), direction, {1, 1, 1}, sample, at.primitive, 1,
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
  const std::uint32_t row_rays_;
  RayQueue rays_;
};

struct HalfRow {
  Color source;
  std::vector<TransportEntry> entries;
};
using Row = std::array<HalfRow, 2>;

/// The rows of the patches from `first` on.
void trace_some_rows(const CompiledScene& scene, const std::vector<std::vector<PatchPoint>>& points, std::size_t first,
                     std::uint32_t row_rays, Wavefront<AllFeatures>& tracer, std::span<Row> rows) {
  RowRays rays(scene, tracer.batch(), row_rays);
  for (std::size_t i = 0; i < rows.size(); ++i) rays.add(static_cast<std::uint32_t>(first + i), points[first + i]);
  std::vector<PathTermination> terminations;
  if (!tracer.trace_from_patches(rays.rays(), terminations)) return;
  const std::uint32_t half_rays = row_rays / 2;
  const double share = 1.0 / half_rays;
  const auto half_of = [&](std::size_t sample) -> HalfRow& {
    return rows[sample / row_rays][sample % row_rays / half_rays];
  };
  for (std::size_t sample = 0; sample < tracer.radiance().size(); ++sample)
    if (finite(tracer.radiance()[sample])) half_of(sample).source += tracer.radiance()[sample] * share;
  for (const PathTermination& termination : terminations)
    half_of(termination.sample).entries.emplace_back(termination.entry.patch, termination.entry.share() * share);
  for (Row& row : rows)
    for (HalfRow& half : row) merge_entries(half.entries);
}

}  // namespace

SurfacePatches divide_surfaces(const PatchPoints& surfaces, double wanted, std::uint32_t patches_max,
                               const RenderControl& control) {
  constexpr double points_per_patch = 16;
  constexpr int attempts_max = 4;
  SurfacePatches patches;
  patches.limited = wanted > patches_max;
  if (!(surfaces.per_line() > 0)) return patches;
  const double cells = std::min<double>(wanted, patches_max);
  double side = std::sqrt(surfaces.per_line() * 4 * std::numbers::pi / cells) * surfaces.region().radius;
  const std::vector<PatchPoint> points = surfaces.points(cells * points_per_patch, side * 0x1p-6);
  for (int attempt = 1; attempt <= attempts_max; ++attempt, side *= 1.25) {
    patches.grid = PatchGrid(side);
    patches.points.clear();
    bool full = false;
    for (const PatchPoint& at : points) {
      if (control.cancelled()) return patches;
      const std::uint32_t patch =
          patches.grid.insert(at.object, offset_origin(at.point, at.outward, at.outward), at.normal, patches_max);
      full = full || patch == PatchGrid::none;
      if (full && attempt < attempts_max) break;
      if (patch == PatchGrid::none) continue;
      if (patch == patches.points.size()) patches.points.emplace_back();
      if (patches.points[patch].size() < points_of_patch_max) patches.points[patch].push_back(at);
    }
    if (!full) return patches;
    patches.limited = true;
  }
  return patches;
}

SurfaceRows trace_rows(const CompiledScene& scene, const std::vector<std::vector<PatchPoint>>& points,
                       std::uint32_t row_rays, RenderControl& control) {
  const std::size_t block = std::max<std::size_t>(1, bounce_rays_max / 4 / row_rays);
  std::vector<Row> rows(points.size());
  TracerPool<Wavefront<AllFeatures>> pool(make<Wavefront<AllFeatures>>, scene, control, scene.accuracy.approximate);
  const std::size_t blocks = (rows.size() + block - 1) / block;
  std::atomic<std::size_t> done{0};
  control.begin_build_step();
  for_each_tile(blocks, 0, [&](std::uint64_t number) {
    if (control.cancelled()) return;
    const std::size_t first = number * block;
    const auto tracer = pool.lease();
    trace_some_rows(scene, points, first, row_rays, *tracer,
                    std::span(rows).subspan(first, std::min(block, rows.size() - first)));
    control.reach_in_build_step(static_cast<double>(++done) / static_cast<double>(blocks));
  });
  SurfaceRows all;
  for (std::size_t half = 0; half < 2; ++half) {
    std::size_t entries = 0;
    for (const Row& row : rows) entries += row[half].entries.size();
    all.halves[half].reserve(rows.size(), entries);
    for (Row& row : rows) {
      if (control.cancelled()) break;
      all.halves[half].add_row(row[half].source, row[half].entries);
      row[half].entries = {};
    }
  }
  all.rays = pool.statistics().rays.total();
  return all;
}

}  // namespace tracer
