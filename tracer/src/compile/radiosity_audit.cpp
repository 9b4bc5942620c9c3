#include "tracer/src/compile/radiosity_audit.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/part_units.h"

namespace tracer {
namespace {

constexpr std::uint32_t half_min = 32;
/// Beyond the looks that samplers take.
constexpr std::uint32_t first_look = 1u << 30;

Approximations without_patches(Approximations approximate) {
  approximate.interreflection = Approximations::Interreflection::exact;
  return approximate;
}

/// Pixels that are spread over the image.
std::vector<Look> spread_looks(const ImageSize& image, std::uint64_t seed) {
  std::vector<Look> looks;
  const std::size_t wanted = path_looks(std::size_t{image.width} * image.height);
  for (std::uint32_t i = 0; i < wanted; ++i) {
    const Vec2 at = sequence_point(i, mix(seed ^ 0x6175646974u));
    const auto pixel = [](double share, std::uint32_t count) {
      return std::min(static_cast<std::uint32_t>(share * count), count - 1);
    };
    looks.push_back({pixel(at.y, image.height) * image.width + pixel(at.x, image.width), first_look + i, 1});
  }
  return looks;
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

RadiosityAudit::RadiosityAudit(const CompiledScene& scene, double squared_target, RenderControl& control)
    : scene_(scene),
      squared_target_(squared_target),
      control_(control),
      tiles_(PixelWindow{0, 0, scene.image.width, scene.image.height}),
      looks_(spread_looks(scene.image, scene.accuracy.seed)),
      exact_pool_(scene, control, without_patches(scene.accuracy.approximate)),
      pool_(scene, control, scene.accuracy.approximate) {}

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
  constexpr double noise_max = 6;  // of a look; over 512 of them it is some 0.25
  Found exact = trace(exact_pool_, half_min);
  noise_ = half_min * distance(exact, few, few, display_of(few)).noise;
  rays_of_path_ = static_cast<double>(exact_pool_.statistics().rays.total()) /
                  static_cast<double>(exact_pool_.statistics().samples);
  const double wanted = noise_ / (noise_max * squared_target_);
  if (has_time_budget(scene_) || wanted <= half_min) return exact;
  const std::uint32_t half = std::bit_ceil(static_cast<std::uint32_t>(std::min<double>(wanted, look_half_max)));
  const Found many = trace(pool_, half);
  exact = trace(exact_pool_, half);
  return combined(combined(exact, 1, many, -1), 1, few, 1);
}

std::uint64_t RadiosityAudit::rays() const {
  return exact_pool_.statistics().rays.total() + pool_.statistics().rays.total();
}

RadiosityAudit::Found RadiosityAudit::trace(Pool& pool, std::uint32_t half) const {
  constexpr std::uint32_t block_samples = 4096;
  const std::size_t block = std::max<std::size_t>(1, block_samples / (2 * half));
  const std::size_t blocks = (looks_.size() + block - 1) / block;
  std::atomic<std::size_t> done{0};
  Found found(looks_.size());
  for_each_tile(blocks, 0, [&](std::uint64_t number) {
    if (control_.cancelled()) return;
    typename Pool::Lease tracer(pool);
    const std::size_t first = number * block, count = std::min(block, looks_.size() - first);
    trace_looks(scene_, tiles_, std::span(looks_).subspan(first, count), half, 0, *tracer,
                std::span(found).subspan(first, count));
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
                                                  const DisplayTransform& display) {
  const double share = 1 / (3 * static_cast<double>(values.size()));
  Distance sum;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!a[i] || !b[i] || !values[i]) continue;
    const HalvesDistance distance(((*values[i])[0] + (*values[i])[1]) * 0.5, *a[i], *b[i], display);
    sum.squared += distance.squared * share;
    sum.noise += distance.noise * share;
  }
  return sum;
}

}  // namespace tracer
