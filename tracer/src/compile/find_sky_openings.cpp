// The openings through which surfaces see the sky.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>
#include <vector>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::uint32_t view_side_min = 32, view_side_max = 64;  ///< camera rays along one side of the image
constexpr std::uint32_t view_bounces = 3, rays_of_point = 16;
constexpr std::size_t block_of_points = 256;
constexpr std::uint64_t openings_key = 0x6f70656e696e6773u;
/// Points from which more rays than this share meet the sky are outside. If more do in the mean of those inside, rays
/// distributed as the cosine find it as well.
constexpr double seen_outside = 0.5, seen_inside = 0.15;

/// A ray from a point that met the sky.
struct Sighting {
  std::uint32_t point = 0;
  Vec3 direction;
};

Vec3 origin_at(const PatchPoint& at) { return offset_origin(at.point, at.outward, at.outward); }

/// The direction in which most of the light continues from a surface that does not scatter it.
Vec3 specular_direction(const CompiledMaterial& material, const Vec3& direction, const Vec3& normal) {
  const bool through = max_component(material.transmittance) > max_component(material.reflectance);
  return through ? direction : unit(reflected(direction, normal));
}

/// Follows paths of light backward over some bounces.
std::vector<PatchPoint> points_on_paths(const CompiledScene& scene, RayQueue& rays, std::uint64_t key) {
  std::vector<PatchPoint> points;
  RayQueue next;
  Hits hits;
  for (std::uint32_t bounce = 0; bounce <= view_bounces && !rays.empty(); ++bounce) {
    scene.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
    next.clear();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits.primitive[i].hit()) continue;
      const Surface at = surface_at(scene, hits.at(i), rays.origin(i), rays.direction(i));
      const CompiledMaterial& material = scene.terms[at.material];
      const bool diffuse = max_component(material.scattered()) > 0;
      const Vec3 outward = at.back ? -at.geometric_normal : at.geometric_normal;
      const Vec2 xi = shuffled_point(rays.sample(i), mix(key ^ bounce));
      const Vec3 direction =
          diffuse ? diffuse_direction(at.normal, xi) : specular_direction(material, rays.direction(i), at.normal);
      if (diffuse) points.push_back({at.point, at.normal, outward, at.object, hits.primitive[i]});
      next.push(offset_origin(at.point, at.geometric_normal, direction), direction, {}, rays.sample(i),
                hits.primitive[i], 0, 0);
    }
    std::swap(rays, next);
  }
  return points;
}

/// The rays from the points that meet the sky. `direction_of(point, xi)` aims them.
template <class DirectionOf>
std::vector<Sighting> look_out(const CompiledScene& scene, const std::vector<PatchPoint>& points, std::uint64_t key,
                               const RenderControl& control, const DirectionOf& direction_of) {
  const std::size_t blocks = (points.size() + block_of_points - 1) / block_of_points;
  return values_of_tiles<Sighting>(blocks, [&](std::uint64_t block) {
    std::vector<Sighting> seen;
    if (control.cancelled()) return seen;
    RayQueue rays;
    const std::size_t first = block * block_of_points;
    for (std::size_t i = first; i < std::min(first + block_of_points, points.size()); ++i)
      for (std::uint32_t ray = 0; ray < rays_of_point; ++ray) {
        const Vec3 direction = direction_of(points[i], shuffled_point(ray, mix(key ^ i)));
        if (dot(direction, points[i].outward) > 0 && dot(direction, points[i].normal) > 0)
          rays.push(origin_at(points[i]), direction, {}, static_cast<std::uint32_t>(i), points[i].primitive, 0, 0);
      }
    Hits hits;
    scene.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (!hits.primitive[i].hit()) seen.push_back({rays.sample(i), rays.direction(i)});
    return seen;
  });
}

/// Openings at which the sightings have the power of their radiance, weighted by the balance heuristic between rays
/// distributed as the cosine and those toward the openings known before; none: all are of the first kind.
SkyOpenings openings_at(const CompiledScene& scene, const Bounds& box, const std::vector<PatchPoint>& points,
                        const std::vector<Sighting>& seen, const SkyOpenings& known) {
  std::vector<SkySighting> sightings;
  for (const auto& [point, direction] : seen) {
    const Vec3 from = origin_at(points[point]);
    const double own = dot(points[point].normal, direction) / std::numbers::pi;
    const double other = known.empty() ? 0 : known.density(from, direction);
    sightings.push_back(
        {from, direction, max_component(scene.background->radiance(direction, 0)), own / (own + other)});
  }
  return {box, sightings};
}

}  // namespace

std::vector<PatchPoint> points_in_view(const CompiledScene& scene, const RenderControl& control) {
  const std::uint64_t key = mix(scene.accuracy.seed ^ openings_key);
  const double pixels = static_cast<double>(scene.image.width) * scene.image.height;
  const auto side =
      static_cast<std::uint32_t>(std::clamp(std::sqrt(pixels) / 8, 1.0 * view_side_min, 1.0 * view_side_max));
  const auto across = static_cast<double>(scene.image.width) / side,
             down = static_cast<double>(scene.image.height) / side;
  return values_of_tiles<PatchPoint>(side, [&](std::uint64_t row) {
    RayQueue rays;
    for (std::uint32_t x = 0; x < side && !control.cancelled(); ++x) {
      const CompiledCamera::CameraRay ray =
          scene.camera.generate_ray((x + 0.5) * across, (static_cast<double>(row) + 0.5) * down);
      rays.push(ray.origin, ray.direction, {}, static_cast<std::uint32_t>(row) * side + x, {}, 0, 0);
    }
    return points_on_paths(scene, rays, key);
  });
}

SkyOpenings find_sky_openings(const CompiledScene& scene, const std::function<std::vector<PatchPoint>()>& find_points,
                              const RenderControl& control) {
  if (const Color* const plain = scene.background->plain(); plain != nullptr && is_black(*plain)) return {};
  const std::vector<PatchPoint> points = find_points();
  const std::uint64_t key = mix(scene.accuracy.seed ^ ~openings_key);
  std::vector<Sighting> seen = look_out(scene, points, key, control, [](const PatchPoint& at, const Vec2& xi) {
    return diffuse_direction(at.normal, xi);
  });
  std::vector<std::uint32_t> counts(points.size());
  for (const Sighting& sighting : seen) ++counts[sighting.point];
  const auto is_outside = [&](std::uint32_t point) { return counts[point] > seen_outside * rays_of_point; };
  const auto from_outside = [&](const Sighting& sighting) { return is_outside(sighting.point); };
  std::erase_if(seen, from_outside);
  Bounds box;
  std::size_t inside = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (is_outside(i)) continue;
    ++inside;
    box.include(origin_at(points[i]));
  }
  const double share = static_cast<double>(seen.size()) / (static_cast<double>(inside) * rays_of_point);
  if (control.cancelled() || !(share > 0 && share < seen_inside)) return {};
  const Vec3 margin = (box.high - box.low) * 0x1p-10;  // points on a wall are within the box
  box = {box.low - margin, box.high + margin};
  const SkyOpenings first = openings_at(scene, box, points, seen, {});
  if (first.empty()) return {};
  const auto more = look_out(scene, points, ~key, control, [&](const PatchPoint& at, const Vec2& xi) {
    return first.sample(origin_at(at), xi).direction;
  });
  std::ranges::remove_copy_if(more, std::back_inserter(seen), from_outside);
  return openings_at(scene, box, points, seen, first);
}

}  // namespace tracer
