#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "tracer/limits.h"
#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/compile/radiosity_audit.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/compile/surface_rows.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/radiosity/smoothing.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {
namespace {

/// Infinite planes are divided as far as three radii of everything else.
Region region_of(const CompiledScene& scene, const Bounds& finite) {
  const Vec3 low = scene.frame.render_from_world(finite.low), high = scene.frame.render_from_world(finite.high);
  const double radius = length(high - low) * 0.5;
  return {(low + high) * 0.5, scene.geometry().planes.point.empty() ? radius : 3 * radius};
}

/// Square of the error that patches may leave of the target: the rest is left to the samples.
double squared_share_of(const Accuracy& accuracy) {
  constexpr double share = 0.3, target_without_one = 2;
  const double target = accuracy.target().value_or(accuracy.tile_target().value_or(target_without_one));
  return share * target * target;
}

/// The number of patches and of rays in each row. Powers of two: scenes that differ in the view find them in the cache.
struct Stage {
  std::uint32_t patches = 1024, row_rays = 128;
  [[nodiscard]] std::uint64_t rays() const { return std::uint64_t{patches} * row_rays; }
};

/// Doubles twice at most what lowers the predicted error most: patches, whose part of the squared error is in inverse
/// proportion to their number, or rays, whose part falls with the power `variance_power`.
Stage next_stage(Stage stage, const AuditedError& error, double squared_share) {
  constexpr std::uint32_t row_rays_max = 2048;
  const double of_more_rays = std::exp2(-variance_power);
  double chance = std::clamp(error.chance, 0.0, std::max(0.0, error.squared)), size = error.squared - chance;
  for (int doubling = 0; doubling < 2 && size + chance > squared_share; ++doubling) {
    const bool more_patches = 2 * stage.patches <= Limits{}.radiosity_patches;
    if (more_patches && (size / 2 >= chance * (1 - of_more_rays) || stage.row_rays == row_rays_max)) {
      stage.patches *= 2;
      size /= 2;
    } else {
      stage.row_rays = std::min(2 * stage.row_rays, row_rays_max);
      chance *= of_more_rays;
    }
  }
  return stage;
}

PatchNeighbors neighbors_of(const PatchGrid& grid, const std::vector<std::vector<PatchPoint>>& points) {
  PatchNeighbors neighbors;
  for (const std::vector<PatchPoint>& of_patch : points) {
    const PatchPoint& at = of_patch.front();
    const Vec3 origin = offset_origin(at.point, at.outward, at.outward);
    const auto beside = [&](int a, int b) { return grid.beside(at.object, origin, at.normal, a, b); };
    const auto pair = [&](int a, int b) { return std::array{beside(a, b), beside(-a, -b)}; };
    neighbors.push_back({pair(1, 0), pair(0, 1), pair(1, 1), pair(1, -1)});
  }
  return neighbors;
}

using Solved = Result<std::shared_ptr<const Radiosity>, Failure>;

/// The light of patches that the cache has under the name, or that `build` returns as a Solved.
template <class Build>
Solved cached(const BuildContext& context, const std::string& name, const Build& build) {
  using Ticket = std::optional<LruCache::BuildTicket>;
  auto ticket = context.cache_entry != nullptr ? context.cache_entry->radiosity(name, context.control)
                                               : Result<Ticket, Failure>(Ticket());
  if (!ticket) return ticket.error();
  if (*ticket && (*ticket)->found()) return std::static_pointer_cast<const Radiosity>((*ticket)->found());
  Solved built = build();
  if (*ticket && built && *built && !context.control.cancelled()) (*ticket)->store(*built, (*built)->memory_bytes());
  return built;
}

/// All that decides the number of stages beside the scene: how levels follow from radiance, and the number of pixels.
std::string name_of_view(const CompiledScene& scene) {
  return std::to_string(std::bit_cast<std::uint64_t>(scene.output.exposure)) + ", " +
         std::to_string(static_cast<int>(scene.output.overflow)) + ", " +
         std::to_string(std::uint64_t{scene.image.width} * scene.image.height);
}

/// Refines the light of patches in stages until its error is within its share of the target.
class RadiosityRefinement {
 public:
  RadiosityRefinement(CompiledScene& scene, const Region& region, const BuildContext& context)
      : scene_(scene),
        context_(context),
        surfaces_(scene, region, context.control),
        squared_share_(squared_share_of(scene.accuracy)) {}

  /// The light of the last stage, with the rays of all; null if no surface has patches.
  Solved run() {
    std::shared_ptr<Radiosity> radiosity;
    if (!(surfaces_.per_line() > 0)) return Solved(radiosity);
    const auto points = [this] { return surfaces_.points(1 << 13, 0, 1); };
    const SkyOpenings openings = find_sky_openings(scene_, points, context_.control);
    sample_sky_openings(scene_, openings);
    RadiosityAudit audit(scene_, surfaces_, squared_share_, context_.control);
    constexpr double unknown = std::numeric_limits<double>::infinity();
    std::array<double, 2> before{unknown, unknown};  // squared errors of the last two stages
    for (Stage stage;;) {
      const double started_ms = elapsed_ms();
      auto solved = solve(stage);
      if (!solved) return solved.error();
      if (context_.control.cancelled() || (*solved)->arriving.empty()) break;
      radiosity = std::make_shared<Radiosity>(**solved);
      scene_.objects.radiosity = radiosity;
      const AuditedError error = audit.measure(*radiosity);
      count(*radiosity);
      if (context_.control.cancelled() || error.squared <= squared_share_) break;
      const Stage next = next_stage(stage, error, squared_share_);
      const double growth = static_cast<double>(next.rays()) / static_cast<double>(stage.rays());
      const double next_rays = growth * static_cast<double>(radiosity->figures.rays);
      figures_.limited =
          figures_.limited || next.rays() == stage.rays() || static_cast<double>(figures_.rays) + next_rays > rays_max;
      const bool lowered = error.squared < 0.9 * before[0];
      const bool pays = next_rays <= std::max(stage_rays_min, pixels() * audit.rays_by_paths());
      const bool in_time = !has_budget() || elapsed_ms() + growth * (elapsed_ms() - started_ms) <= budget_ms();
      if (figures_.limited || !lowered || !pays || !in_time) break;
      before = {before[1], error.squared};
      stage = next;
    }
    if (!radiosity) return Solved(radiosity);
    radiosity->figures = figures_;
    radiosity->openings = openings;
    return Solved(radiosity);
  }

 private:
  /// Rays of all stages. Entries take up to 16 bytes for each.
  static constexpr double rays_max = 1 << 25;
  /// A stage may take so many rays even if paths would find a small image with fewer.
  static constexpr double stage_rays_min = 1 << 21;
  /// Part of a time budget for all stages.
  static constexpr double budget_share = 0.25;

  [[nodiscard]] double pixels() const { return static_cast<double>(scene_.image.width) * scene_.image.height; }
  [[nodiscard]] bool has_budget() const {
    return context_.elapsed_ms && scene_.accuracy.adaptive && scene_.accuracy.adaptive->time_budget_ms;
  }
  [[nodiscard]] double budget_ms() const { return budget_share * *scene_.accuracy.adaptive->time_budget_ms; }
  [[nodiscard]] double elapsed_ms() const { return has_budget() ? context_.elapsed_ms() : 0; }

  Solved solve(const Stage& stage) {
    const std::string name = std::to_string(stage.patches) + " patches, " + std::to_string(stage.row_rays) + " rays";
    return cached(context_, name, [&] { return build(stage); });
  }

  Solved build(const Stage& stage) {
    scene_.cache_hits.radiosity = false;
    constexpr double tolerance = 1e-5;
    constexpr std::uint32_t sweeps_max = 1000;
    SurfacePatches patches = divide_surfaces(surfaces_, stage.patches, Limits{}.radiosity_patches, context_.control);
    auto radiosity = std::make_shared<Radiosity>();
    radiosity->patches = std::move(patches.grid);
    scene_.objects.radiosity = radiosity;  // rows need the patches
    const SurfaceRows rows = trace_rows(scene_, patches.points, stage.row_rays, context_.control);
    std::array<TransportSolution, 2> solutions;
    context_.control.begin_build_step();
    for_each_tile(solutions.size(), 0, [&](std::uint64_t half) {
      solutions[half] = tracer::solve(rows.halves[half], tolerance, sweeps_max, context_.control);
    });
    RadiosityFigures& figures = radiosity->figures;
    figures.patches = static_cast<std::uint32_t>(patches.points.size());
    figures.limited = patches.limited;
    figures.rays = rows.rays;
    for (std::size_t half = 0; half < 2; ++half) {
      figures.factors += rows.halves[half].entries();
      figures.sweeps = std::max(figures.sweeps, solutions[half].sweeps);
      figures.bound = std::max(figures.bound, solutions[half].bound);
      radiosity->by_half_the_rays[half] = std::move(solutions[half].values);
    }
    if (!context_.control.cancelled())
      smooth(radiosity->by_half_the_rays, neighbors_of(radiosity->patches, patches.points));
    const auto& [first, second] = radiosity->by_half_the_rays;
    for (std::size_t patch = 0; patch < std::min(first.size(), second.size()); ++patch)  // equal unless cancelled
      radiosity->arriving.push_back((first[patch] + second[patch]) * 0.5);
    return Solved(radiosity);
  }

  void count(const Radiosity& radiosity) {
    const std::uint64_t rays = figures_.rays, stages = figures_.stages;
    figures_ = radiosity.figures;
    figures_.rays += rays;
    figures_.stages = static_cast<std::uint32_t>(stages + 1);
  }

  CompiledScene& scene_;
  const BuildContext& context_;
  const PatchPoints surfaces_;
  const double squared_share_;
  RadiosityFigures figures_;
};

}  // namespace

std::optional<Failure> solve_radiosity(CompiledScene& scene, const Bounds& finite, const BuildContext& context) {
  const Region region = region_of(scene, finite);
  if (!(region.radius > 0)) return std::nullopt;
  scene.cache_hits.radiosity = true;  // unless a stage is built
  auto refined =
      cached(context, name_of_view(scene), [&] { return RadiosityRefinement(scene, region, context).run(); });
  if (!refined) return refined.error();
  scene.objects.radiosity = *refined;
  if (*refined == nullptr) scene.cache_hits.radiosity = false;
  if (scene.cache_hits.radiosity) sample_sky_openings(scene, (*refined)->openings);
  return std::nullopt;
}

}  // namespace tracer
