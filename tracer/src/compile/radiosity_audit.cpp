#include "tracer/src/compile/radiosity_audit.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/looks.h"

namespace tracer {
namespace {

constexpr std::uint32_t half_min = 16;
constexpr std::uint64_t audit_key = 0x6175646974u;

Approximations without_patches(Approximations approximate) {
  approximate.interreflection = Approximations::Interreflection::exact;
  return approximate;
}

/// One ray for each look: from a point that light reaches at what lies in a random direction, or at the point itself
/// from outside. No view decides, so that all views of a scene have the same patches.
RayQueue draw_looks(const CompiledScene& scene, const PatchPoints& surfaces) {
  const std::size_t wanted = path_looks(std::size_t{scene.image.width} * scene.image.height);
  const std::vector<PatchPoint> points = surfaces.points(2 * static_cast<double>(wanted), 0, audit_key);
  RayQueue rays, looks;
  for (std::uint32_t i = 0; i < std::min(wanted, points.size()); ++i) {
    const PatchPoint& at = points[i];
    const Vec3 direction = diffuse_direction(at.outward, sequence_point(i, mix(scene.accuracy.seed ^ audit_key)));
    rays.push(offset_origin(at.point, at.outward, at.outward), direction, {1, 1, 1}, i, at.primitive, 0,
              MediumStack::outside);
  }
  Hits hits;
  scene.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    if (hits.primitive[i].hit()) {
      looks.push(rays, i);
    } else {
      const Vec3 way = rays.direction(i), outside = rays.origin(i) + way * surfaces.region().radius;
      looks.push(outside, -way, {1, 1, 1}, i, {}, 0, MediumStack::outside);
    }
  }
  return looks;
}

/// Adds both halves of samples of a look to the batch, and their rays.
void add_samples(const CompiledScene& scene, const RayQueue& looks, std::size_t look, std::uint32_t half_size,
                 Batch& batch, RayQueue& rays) {
  for (std::uint64_t half = 0; half < 2; ++half)
    for (std::uint32_t index = 0; index < half_size; ++index) {
      rays.push(looks.origin(look), looks.direction(look), looks.throughput(look),
                static_cast<std::uint32_t>(batch.samples.size()), looks.from(look), 0, looks.media(look));
      rays.set_cone({});
      batch.samples.push_back({pixel_key(2 * look + half, mix(scene.accuracy.seed ^ audit_key)), index});
    }
}

/// Sum of the halves of both, multiplied by factors.
std::vector<std::optional<Halves>> combined(std::vector<std::optional<Halves>> a, double factor_a,
                                            const std::vector<std::optional<Halves>>& b, double factor_b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!b[i]) a[i].reset();
    for (std::size_t half = 0; a[i] && half < 2; ++half)
      (*a[i])[half] = (*a[i])[half] * factor_a + (*b[i])[half] * factor_b;
  }
  return a;
}

bool has_time_budget(const CompiledScene& scene) {
  return scene.accuracy.adaptive && scene.accuracy.adaptive->time_budget_ms;
}

}  // namespace

RadiosityAudit::RadiosityAudit(const CompiledScene& scene, const PatchPoints& surfaces, double squared_target,
                               RenderControl& control)
    : scene_(scene),
      squared_target_(squared_target),
      control_(control),
      looks_(draw_looks(scene, surfaces)),
      exact_pool_(make<Wavefront<AllFeatures>>, scene, control, without_patches(scene.accuracy.approximate)),
      pool_(make<Wavefront<AllFeatures>>, scene, control, scene.accuracy.approximate) {}

AuditedError RadiosityAudit::measure(Radiosity& radiosity) {
  control_.begin_build_step();
  const std::vector<Color> whole = radiosity.arriving;
  radiosity.arriving = radiosity.by_half_the_rays[0];
  const Found first = trace(pool_, half_min);
  radiosity.arriving = radiosity.by_half_the_rays[1];
  const Found second = trace(pool_, half_min);
  radiosity.arriving = whole;
  const Found found = combined(first, 0.5, second, 0.5);
  if (exact_.empty()) exact_ = trace_exact(found);
  const DisplayTransform display = display_of(found);
  const Distance error = distance(exact_, found, found, display);
  // Halves of the rays differ more than independent ones, for they are stratified together.
  const double of_difference = 0.25 / (std::exp2(variance_power) - 1);
  return {error.squared, of_difference * distance(first, second, found, display).squared};
}

RadiosityAudit::Found RadiosityAudit::trace_exact(const Found& few) {
  constexpr double noise_max = 12;  // of a look; over 512 of them it is some 0.5
  Found exact = trace(exact_pool_, half_min);
  noise_ = half_min * distance(exact, few, few, display_of(few)).noise;
  rays_of_path_ = static_cast<double>(exact_pool_.statistics().rays.total()) /
                  static_cast<double>(exact_pool_.statistics().samples);
  const double wanted = noise_ / (noise_max * squared_target_);
  if (wanted <= (has_time_budget(scene_) ? half_min : look_half_max)) look_most_ = 160 * squared_target_;
  if (has_time_budget(scene_) || wanted <= half_min) return exact;
  const std::uint32_t half = std::bit_ceil(static_cast<std::uint32_t>(std::min<double>(wanted, look_half_max)));
  const Found many = trace(pool_, half);
  exact = trace(exact_pool_, half);
  return combined(combined(exact, 1, many, -1), 1, few, 1);
}

RadiosityAudit::Found RadiosityAudit::trace(Pool& pool, std::uint32_t half) const {
  constexpr std::uint32_t block_samples = 4096;
  const std::size_t block = std::max<std::size_t>(1, block_samples / (2 * half));
  const std::size_t blocks = (looks_.size() + block - 1) / block;
  std::atomic<std::size_t> done{0};
  Found found(looks_.size());
  for_each_tile(blocks, 0, [&](std::uint64_t number) {
    if (control_.cancelled()) return;
    const auto lease = pool.lease();
    Wavefront<AllFeatures>& tracer = *lease;
    tracer.batch().clear();
    tracer.batch().light_points = 2;
    const std::size_t first = number * block, count = std::min(block, looks_.size() - first);
    RayQueue rays;
    for (std::size_t look = first; look < first + count; ++look)
      add_samples(scene_, looks_, look, half, tracer.batch(), rays);
    if (tracer.trace(rays)) average_halves(tracer.radiance(), half, std::span(found).subspan(first, count));
    control_.reach_in_build_step(static_cast<double>(++done) / static_cast<double>(blocks));
  });
  return found;
}

DisplayTransform RadiosityAudit::display_of(const Found& found) const {
  std::vector<float> values;  // the brightest one may determine the display
  for (const std::optional<Halves>& halves : found)
    if (halves)
      values.push_back(static_cast<float>(std::max(max_component((*halves)[0]), max_component((*halves)[1]))));
  return {scene_.output, brightest_if_needed(scene_, values)};
}

RadiosityAudit::Distance RadiosityAudit::distance(const Found& a, const Found& b, const Found& values,
                                                  const DisplayTransform& display) const {
  const double share = 1 / (3 * static_cast<double>(values.size()));
  Distance sum;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!a[i] || !b[i] || !values[i]) continue;
    const HalvesDistance distance(((*values[i])[0] + (*values[i])[1]) * 0.5, *a[i], *b[i], display);
    sum.squared += std::clamp(distance.squared, -look_most_, look_most_) * share;
    sum.noise += distance.noise * share;
  }
  return sum;
}

}  // namespace tracer
