#include "tracer/src/compile/patch_points.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <numbers>

#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::uint32_t trial_lines = 4096;
constexpr std::size_t block_of_rays = 256;

Vec3 on_unit_sphere(const Vec2& xi) {
  const double z = 1 - 2 * xi.x, across = std::sqrt(std::max(0.0, 1 - z * z)), angle = 2 * std::numbers::pi * xi.y;
  return {across * std::cos(angle), across * std::sin(angle), z};
}

bool is_emissive(const Material& material) {
  const auto* plain = std::get_if<Color>(&material.emission);
  return plain == nullptr || !is_black(*plain);
}

/// True if light arrives from outside of all finite surfaces.
bool is_lit_from_outside(const CompiledScene& scene) {
  const Color* plain = scene.background->plain();
  return plain == nullptr || !is_black(*plain) ||
         std::any_of(scene.lights.begin(), scene.lights.end(),
                     [](const CompiledLight& light) { return light.kind == light_kind<DirectionalLight>; });
}

}  // namespace

Vec3 diffuse_direction(const Vec3& normal, const Vec2& xi) {
  const Vec3 local = cosine_direction(xi);
  const Axes axes = axes_about(normal);
  return unit(axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
}

PatchPoints::PatchPoints(const CompiledScene& scene, const Region& region, RenderControl& control)
    : scene_(scene), region_(region), control_(control) {
  const auto hits = from_lines<LineHit>(trial_lines, 0, std::identity());
  find_dark_sides(hits);
  per_line_ = static_cast<double>(lit(hits, 0).size()) / trial_lines;
}

std::vector<PatchPoint> PatchPoints::on_lines(std::uint32_t lines, double gap, std::uint64_t stream) const {
  return from_lines<PatchPoint>(lines, stream, [&](const std::vector<LineHit>& hits) { return lit(hits, gap); });
}

template <class T, class Select>
std::vector<T> PatchPoints::from_lines(std::uint32_t lines, std::uint64_t stream, const Select& select) const {
  constexpr int hits_of_line_max = 64;
  const std::uint64_t key = mix(scene_.accuracy.seed ^ stream ^ 0x7261646961746573u);
  const std::uint64_t blocks = (lines + block_of_rays - 1) / block_of_rays;
  std::atomic<std::size_t> done{0};
  control_.begin_build_step();
  return values_of_tiles<T>(blocks, [&](std::uint64_t number) {
    std::vector<T> selected;
    if (control_.cancelled()) return selected;
    std::vector<LineHit> found;
    RayQueue rays, next;
    const auto first = static_cast<std::uint32_t>(number * block_of_rays);
    for (std::uint32_t line = first; line < std::min<std::uint64_t>(first + block_of_rays, lines); ++line) {
      const Vec3 from = region_.center + on_unit_sphere(sequence_point(line, key)) * region_.radius;
      const Vec3 way = region_.center + on_unit_sphere(shuffled_point(line, mix(key))) * region_.radius - from;
      if (length(way) > 0) rays.push(from, way / length(way), {}, line, {}, 0, 0);
    }
    Hits hits;
    for (int hit = 0; hit < hits_of_line_max && !rays.empty(); ++hit) {
      scene_.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
      next.clear();
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!hits.primitive[i].hit()) continue;
        const Surface at = surface_at(scene_, hits.at(i), rays.origin(i), rays.direction(i));
        if (length(at.point.position - region_.center) > region_.radius * (1 + 0x1p-20)) continue;
        const Vec3 outward = at.back ? -at.geometric_normal : at.geometric_normal;
        const PatchPoint point{at.point, at.normal, outward, at.object, hits.primitive[i]};
        found.push_back({point, rays.sample(i), at.back, max_component(scene_.terms[at.material].scattered()) > 0});
        next.push(offset_origin(at.point, at.geometric_normal, rays.direction(i)), rays.direction(i), {},
                  rays.sample(i), hits.primitive[i], 0, 0);
      }
      std::swap(rays, next);
    }
    std::stable_sort(found.begin(), found.end(), [](const LineHit& a, const LineHit& b) { return a.line < b.line; });
    selected = select(found);
    control_.reach_in_build_step(static_cast<double>(++done) / static_cast<double>(blocks));
    return selected;
  });
}

std::vector<PatchPoints::Walker> PatchPoints::light_sources(const std::vector<LineHit>& hits) {
  constexpr std::size_t rays_of_lights = 4096;
  std::vector<Walker> walkers;
  const bool outside = is_lit_from_outside(scene_);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const bool first = i == 0 || hits[i - 1].line != hits[i].line;
    if (first && outside) dark_[side_of(hits[i].at.object, hits[i].back)] = 0;
    if (!(first && outside) && !is_emissive(scene_.material_of(hits[i].at.object))) continue;
    walkers.push_back(diffuse_walker(hits[i].at, hits[i].line));
  }
  const std::size_t rays = scene_.lights.empty() ? 0 : 1 + rays_of_lights / scene_.lights.size();
  for (std::size_t light = 0; light < scene_.lights.size(); ++light)
    for (std::uint32_t ray = 0; ray < rays; ++ray)
      walkers.push_back({scene_.lights[light].position, on_unit_sphere(sequence_point(ray, mix(light))), {}});
  return walkers;
}

void PatchPoints::add_light_of_emitters(const std::vector<LineHit>& hits, std::vector<Walker>& walkers) {
  if (scene_.objects.emitters.empty()) return;
  RayQueue rays;
  std::vector<PrimitiveRef> emitters;
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    const PatchPoint& at = hits[i].at;
    const Vec3 from = offset_origin(at.point, at.outward, at.outward);
    const Emitters::Sample sample = scene_.objects.emitters.sample(from, sequence_point(i, mix(~scene_.accuracy.seed)));
    if (!(sample.density > 0 && dot(sample.direction, at.outward) > 0)) continue;
    rays.push(from, sample.direction, {}, i, at.primitive, 0, 0);
    emitters.push_back(sample.primitive);
  }
  Hits found;
  scene_.accelerator->intersect(rays.span(), found.resize_to_fit(rays.size()), Coherence::incoherent);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!(found.primitive[i] == emitters[i])) continue;
    const LineHit& lit = hits[rays.sample(i)];
    dark_[side_of(lit.at.object, lit.back)] = 0;
    walkers.push_back(diffuse_walker(lit.at, rays.sample(i)));
  }
}

PatchPoints::Walker PatchPoints::diffuse_walker(const PatchPoint& at, std::uint32_t number) const {
  return {offset_origin(at.point, at.outward, at.outward),
          diffuse_direction(at.outward, shuffled_point(number, mix(scene_.accuracy.seed))), at.primitive};
}

/// Sides that no line meets often enough are taken for lit: they matter little, and paths of light may have missed them
/// by chance.
void PatchPoints::find_dark_sides(const std::vector<LineHit>& hits) {
  constexpr int hits_min = 8, bounces_max = 64, idle_bounces_max = 4;
  std::vector<std::uint32_t> count(2 * scene_.objects.material.size());
  for (const LineHit& hit : hits) ++count[side_of(hit.at.object, hit.back)];
  dark_.resize(count.size());
  std::transform(count.begin(), count.end(), dark_.begin(), [](std::uint32_t n) { return n >= hits_min ? 1 : 0; });
  for (const LineHit& hit : hits)
    if (is_emissive(scene_.material_of(hit.at.object))) dark_[side_of(hit.at.object, hit.back)] = 0;
  std::vector<Walker> walkers = light_sources(hits);
  add_light_of_emitters(hits, walkers);
  for (int bounce = 0, idle = 0; bounce < bounces_max && idle < idle_bounces_max && !control_.cancelled(); ++bounce)
    idle = extend(walkers, pixel_key(static_cast<std::uint64_t>(bounce), ~scene_.accuracy.seed)) ? 0 : idle + 1;
}

bool PatchPoints::extend(std::vector<Walker>& walkers, std::uint64_t key) {
  std::atomic<bool> found{false};
  std::vector<std::uint8_t> goes_on(walkers.size());
  for_each_tile((walkers.size() + block_of_rays - 1) / block_of_rays, 0, [&](std::uint64_t number) {
    const std::size_t first = number * block_of_rays, end = std::min(first + block_of_rays, walkers.size());
    RayQueue rays;
    for (std::size_t i = first; i < end; ++i)
      rays.push(walkers[i].origin, walkers[i].direction, {}, 0, walkers[i].from, 0, 0);
    Hits hits;
    scene_.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
    for (std::size_t i = first; i < end; ++i) {
      if (!hits.primitive[i - first].hit()) continue;
      Walker& walker = walkers[i];
      const Surface at = surface_at(scene_, hits.at(i - first), walker.origin, walker.direction);
      const std::atomic_ref<std::uint8_t> dark(dark_[side_of(at.object, at.back)]);
      if (dark.exchange(0, std::memory_order_relaxed) != 0) found = true;
      const Vec2 xi = shuffled_point(static_cast<std::uint32_t>(i), key);
      const bool passes = lets_light_pass(scene_.material_of(at.object)) || scene_.objects.shadowless[at.object] != 0;
      if (!passes || shuffled_point(static_cast<std::uint32_t>(i), mix(key)).x < 0.5)
        walker.direction = diffuse_direction(at.back ? -at.geometric_normal : at.geometric_normal, xi);
      walker.origin = offset_origin(at.point, at.geometric_normal, walker.direction);
      walker.from = hits.primitive[i - first];
      goes_on[i] = 1;
    }
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < walkers.size(); ++i)
    if (goes_on[i] != 0) walkers[kept++] = walkers[i];
  walkers.resize(kept);
  return found;
}

std::vector<PatchPoint> PatchPoints::lit(const std::vector<LineHit>& hits, double gap) const {
  std::vector<PatchPoint> points;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const LineHit& hit = hits[i];
    if (!hit.receives || dark_[side_of(hit.at.object, hit.back)] != 0) continue;
    if (i > 0 && hits[i - 1].line == hit.line) {
      const LineHit& before = hits[i - 1];
      const bool behind_dark_side = dark_[side_of(before.at.object, !before.back)] != 0;
      if (behind_dark_side || length(hit.at.point.position - before.at.point.position) < gap) continue;
    }
    points.push_back(hit.at);
  }
  return points;
}

}  // namespace tracer
