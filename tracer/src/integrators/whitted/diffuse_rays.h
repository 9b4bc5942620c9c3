#pragma once
/// Global light: rays that continue from diffuse surfaces, in directions distributed as the cosine, and rays toward
/// emitters. Both bring the emission that they find, weighted by the balance heuristic (Veach & Guibas 1995, "Optimally
/// Combining Sampling Techniques for Monte Carlo Rendering"), and diffuse rays everything else.

#include <numbers>

#include "tracer/src/integrators/whitted/wavefront_state.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

template <class Features>
class DiffuseRays {
 public:
  explicit DiffuseRays(WavefrontState<Features>& state) : state_(state) {}

  /// Sets the throughputs of the rays, and what the hit rays carry. Precondition: the shading points have theirs.
  /// `media_behind(lane)`: of the far side of a surface that lets diffuse light through.
  template <class MediaBehind>
  void begin(const RayQueue& rays, const ShadingPointPacket& shading_points, const MediaBehind& media_behind) {
    const HitPacket& hit = state_.hit;
    rays_.going = 0;
    after_diffuse_ = far_side_ = 0;
    for (int i = 0; i < hit.count; ++i) {
      rays_.throughput.set(i, shading_points.diffuse[i]);
      rays_.largest[i] = max_component(shading_points.diffuse[i]);
      media_[i] = shading_points.media[i];
      if ((hit.coefficients.transmits_light >> i & 1) != 0) choose_side(shading_points, i, media_behind);
      rays_.going |= lane_bit(i, rays_.largest[i] > 0);
      rays_.path[i] = static_cast<std::uint32_t>(mix(hit.path[i] | diffuse_bounce));
      weight_[i] = rays.path_state(static_cast<std::size_t>(hit.ray[i])).weight;
      after_diffuse_ |= lane_bit(i, weight_[i] > 0);
    }
  }

  [[nodiscard]] SecondaryRayPacket& rays() { return rays_; }
  [[nodiscard]] const MediumStack::List* media() const { return media_; }
  /// Lanes that were hit after a diffuse bounce: they continue with one ray only.
  [[nodiscard]] LaneMask after_diffuse() const { return after_diffuse_; }
  /// PathState::weight of the ray that hit.
  [[nodiscard]] double weight(int lane) const { return weight_[lane]; }

  /// Adds a ray toward an emitter for each lane with a ray. To be called before any of them is dropped by chance.
  void sample_emitters(const ShadingPointPacket& shading_points, RayQueue& to) const {
    for_each_lane(rays_.going, [&](int i) {
      const Place place = place_of(shading_points, i);
      // The origin of all rays from here: emission_of_lane() must find the same densities.
      const Vec3 origin = offset_origin(place.point, place.outward, place.outward);
      const Emitters::Sample sample = state_.scene.objects.emitters.sample(
          origin, state_.random_point(shading_points.sample[i], state_.hit.path[i], Choice::emitter));
      const double cosine = dot(place.normal, sample.direction);
      if (!(cosine > 0 && dot(sample.direction, place.outward) > 0 && sample.density > 0)) return;
      const double own = cosine / std::numbers::pi;
      to.push(origin, sample.direction, rays_.throughput[i] * (own / (own + sample.density)), shading_points.sample[i],
              shading_points.from[i], rays_.path[i], media_[i]);
      to.set_path_state(to.size() - 1, {.emitter = sample.primitive});
      if (state_.template needs<&Requirements::filtered_textures>()) to.set_cone({});
    });
  }

  /// Aims the rays. Light from below the face is dropped, as that of lights is.
  void aim(const ShadingPointPacket& shading_points) {
    for_each_lane(rays_.going, [&](int i) {
      const Place place = place_of(shading_points, i);
      const Vec3 local =
          cosine_direction(state_.random_point(shading_points.sample[i], state_.hit.path[i], Choice::direction));
      const Axes axes = axes_about(place.normal);
      const Vec3 direction = unit(axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
      if (!(dot(direction, place.outward) > 0)) rays_.going &= ~lane_bit(i);
      rays_.direction.set(i, direction);
      rays_.origin.set(i, offset_origin(place.point, place.outward, place.outward));
      density_[i] = local.z / std::numbers::pi;
    });
  }

  /// State of the lane's ray. Precondition: aim() was called.
  [[nodiscard]] PathState path_state(int lane) const {
    return {.weight = weight_[lane] > 0 ? weight_[lane] : rays_.largest[lane],
            .density = state_.template needs<&Requirements::emitters>() ? density_[lane] : 0};
  }

 private:
  static constexpr std::uint64_t diffuse_bounce = std::uint64_t{1} << 40;  ///< beyond the keys of other bounces

  /// Place at which the light of a lane arrives.
  struct Place {
    BoundedPoint point;
    Vec3 normal, outward;  ///< shading and geometric normal on the incident side
  };

  /// Selects one side of a surface that light comes through, in proportion to the light that is kept there.
  template <class MediaBehind>
  void choose_side(const ShadingPointPacket& shading_points, int lane, const MediaBehind& media_behind) {
    const HitPacket& hit = state_.hit;
    const Color near = shading_points.diffuse[lane];
    const Color far = hit.throughput[lane] * hit.coefficients.diffuse_transmission[lane];
    const double of_near = max_component(near), of_far = max_component(far), sum = of_near + of_far;
    if (!(of_far > 0)) return;
    const bool is_far = state_.random_number(shading_points.sample[lane], hit.path[lane], Choice::side) * sum < of_far;
    rays_.throughput.set(lane, is_far ? far * (sum / of_far) : near * (sum / of_near));
    rays_.largest[lane] = sum;
    if (!is_far) return;
    far_side_ |= lane_bit(lane);
    media_[lane] = media_behind(lane);
  }

  /// The hit; on triangles that are lit at their vertices one of these, selected in proportion to its barycentric
  /// coordinate, or the centroid.
  [[nodiscard]] Place place_of(const ShadingPointPacket& shading_points, int lane) const {
    const HitPacket& hit = state_.hit;
    const bool is_far = (far_side_ >> lane & 1) != 0;
    const double side = (hit.back_face[lane] > 0) != is_far ? -1 : 1;
    const Place place{{hit.points.position[lane], hit.points.error[lane]},
                      is_far ? -shading_points.normal[lane] : shading_points.normal[lane],
                      shading_points.face[lane] * side};
    if (!state_.template needs<&Requirements::gouraud>()) return place;
    const Material::Shading shading = shading_of(state_.material_of_lane(lane).shading, state_.approximate().shading);
    if (!is_lit_by_triangle(shading)) return place;
    const Hit at = state_.hits.at(static_cast<std::size_t>(hit.ray[lane]));
    const auto corners = corners_at(state_.scene, at);
    if (!corners) return place;
    if (shading == Material::Shading::flat_polygon)
      if (const auto centroid = centroid_at(state_.scene, at))
        return {centroid->point, centroid->normal * side, place.outward};
    double left = state_.random_number(shading_points.sample[lane], hit.path[lane], Choice::corner);
    const Corner* chosen = corners->data();
    for (const Corner& corner : *corners) {
      chosen = &corner;
      if ((left -= corner.weight) < 0) break;
    }
    return {chosen->point, chosen->normal * side, place.outward};
  }

  WavefrontState<Features>& state_;
  SecondaryRayPacket rays_;
  LaneMask after_diffuse_ = 0, far_side_ = 0;
  MediumStack::List media_[lanes] = {};
  double weight_[lanes] = {}, density_[lanes] = {};
};

}  // namespace tracer
