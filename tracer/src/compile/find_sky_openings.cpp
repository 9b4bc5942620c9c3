// The openings through which surfaces in the view see a plain sky.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::uint32_t view_side_min = 32, view_side_max = 64;  ///< camera rays along one side of the image
constexpr std::uint32_t view_bounces = 3, rays_of_place = 16;
/// Places from which more rays than this share meet the sky are outside. If more do in the mean of those inside, rays
/// distributed as the cosine find it as well.
constexpr double seen_outside = 0.5, seen_inside = 0.15;

/// A diffuse surface that light arrives at.
struct Place {
  Vec3 origin, normal, outward;  ///< shading and geometric normal
  PrimitiveRef primitive;
};

/// A ray from a place that met the sky.
struct Sighting {
  std::uint32_t place = 0;
  Vec3 direction;
};

/// The places along a row of camera rays, and what is seen from there.
struct ViewRow {
  std::vector<Place> places;
  std::vector<Sighting> seen;
};

/// The direction in which most of the light continues from a surface that does not scatter it.
Vec3 specular_direction(const CompiledMaterial& material, const Vec3& direction, const Vec3& normal) {
  const bool through = max_component(material.transmittance) > max_component(material.reflectance);
  return through ? direction : unit(reflected(direction, normal));
}

/// Follows paths of light backward over some bounces.
std::vector<Place> places_on_paths(const CompiledScene& scene, RayQueue& rays, std::uint64_t key) {
  std::vector<Place> places;
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
      if (diffuse) places.push_back({offset_origin(at.point, outward, outward), at.normal, outward, hits.primitive[i]});
      next.push(offset_origin(at.point, at.geometric_normal, direction), direction, {}, rays.sample(i),
                hits.primitive[i], 0, 0);
    }
    std::swap(rays, next);
  }
  return places;
}

/// The rays from each place that meet the sky. `direction_of(place, xi)` aims them.
template <class DirectionOf>
std::vector<Sighting> look_out(const CompiledScene& scene, const std::vector<Place>& places, std::uint64_t key,
                               const DirectionOf& direction_of) {
  RayQueue rays;
  for (std::uint32_t i = 0; i < places.size(); ++i)
    for (std::uint32_t ray = 0; ray < rays_of_place; ++ray) {
      const Vec3 direction = direction_of(places[i], shuffled_point(ray, mix(key ^ i)));
      if (dot(direction, places[i].outward) > 0 && dot(direction, places[i].normal) > 0)
        rays.push(places[i].origin, direction, {}, i, places[i].primitive, 0, 0);
    }
  Hits hits;
  scene.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::incoherent);
  std::vector<Sighting> seen;
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (!hits.primitive[i].hit()) seen.push_back({rays.sample(i), rays.direction(i)});
  return seen;
}

/// Leaves out the places outside.
ViewRow inside_of(const ViewRow& row) {
  std::vector<std::uint32_t> seen(row.places.size()), number(row.places.size());
  for (const Sighting& sighting : row.seen) ++seen[sighting.place];
  ViewRow inside;
  for (std::size_t i = 0; i < row.places.size(); ++i) {
    number[i] = static_cast<std::uint32_t>(inside.places.size());
    if (seen[i] <= seen_outside * rays_of_place) inside.places.push_back(row.places[i]);
  }
  for (const Sighting& sighting : row.seen)
    if (seen[sighting.place] <= seen_outside * rays_of_place)
      inside.seen.push_back({number[sighting.place], sighting.direction});
  return inside;
}

/// Looks for the sky in all directions from the places of a row.
ViewRow search(const CompiledScene& scene, std::uint64_t number, std::uint32_t side, std::uint64_t key) {
  const auto across = static_cast<double>(scene.image.width) / side,
             down = static_cast<double>(scene.image.height) / side;
  RayQueue rays;
  for (std::uint32_t x = 0; x < side; ++x) {
    const CompiledCamera::CameraRay ray =
        scene.camera.generate_ray((x + 0.5) * across, (static_cast<double>(number) + 0.5) * down);
    rays.push(ray.origin, ray.direction, {}, static_cast<std::uint32_t>(number) * side + x, {}, 0, 0);
  }
  ViewRow row{places_on_paths(scene, rays, key), {}};
  row.seen = look_out(scene, row.places, mix(key ^ number),
                      [](const Place& place, const Vec2& xi) { return diffuse_direction(place.normal, xi); });
  return inside_of(row);
}

/// Openings at which the sightings have the power of their radiance, weighted by the balance heuristic between rays
/// distributed as the cosine and those toward the openings known before; none: all are of the first kind.
SkyOpenings openings_at(const CompiledScene& scene, const Bounds& box, const std::vector<ViewRow>& rows,
                        const SkyOpenings& known) {
  std::vector<SkySighting> sightings;
  for (const ViewRow& row : rows)
    for (const auto& [place, direction] : row.seen) {
      const auto& [from, normal, outward, primitive] = row.places[place];
      const double own = dot(normal, direction) / std::numbers::pi;
      const double other = known.empty() ? 0 : known.density(from, direction);
      const double radiance = max_component(scene.background->radiance(direction, 0));
      sightings.push_back({from, direction, radiance * own / (own + other)});
    }
  return {box, sightings};
}

}  // namespace

SkyOpenings find_sky_openings(const CompiledScene& scene, const RenderControl& control) {
  const CompiledBackground& sky = *scene.background;
  if (!sky.faces().empty() || (sky.plain() != nullptr && is_black(*sky.plain()))) return {};
  const std::uint64_t key = mix(scene.accuracy.seed ^ 0x6f70656e696e6773u);
  const double pixels = static_cast<double>(scene.image.width) * scene.image.height;
  const auto side =
      static_cast<std::uint32_t>(std::clamp(std::sqrt(pixels) / 8, 1.0 * view_side_min, 1.0 * view_side_max));
  std::vector<ViewRow> rows(side);
  for_each_tile(side, 0, [&](std::uint64_t number) {
    if (!control.cancelled()) rows[number] = search(scene, number, side, key);
  });
  Bounds box;
  std::size_t places = 0, seen = 0;
  for (const ViewRow& row : rows) {
    places += row.places.size();
    seen += row.seen.size();
    for (const Place& place : row.places) box.include(place.origin);
  }
  const double share = static_cast<double>(seen) / (static_cast<double>(places) * rays_of_place);
  if (!(share > 0 && share < seen_inside)) return {};
  const Vec3 margin = (box.high - box.low) * 0x1p-10;  // places on a wall are within the box
  box = {box.low - margin, box.high + margin};
  const SkyOpenings first = openings_at(scene, box, rows, {});
  if (first.empty()) return {};
  for_each_tile(side, 0, [&](std::uint64_t number) {
    if (control.cancelled()) return;
    ViewRow& row = rows[number];
    const auto more = look_out(scene, row.places, ~mix(key ^ number), [&](const Place& place, const Vec2& xi) {
      return first.sample(place.origin, xi).direction;
    });
    row.seen.insert(row.seen.end(), more.begin(), more.end());
  });
  return openings_at(scene, box, rows, first);
}

}  // namespace tracer
