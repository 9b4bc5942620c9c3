#pragma once
/// Global light: rays that continue from diffuse surfaces, in directions distributed as the cosine, and rays toward
/// emitters. Both bring the emission that they find, weighted by the balance heuristic (Veach & Guibas 1995, "Optimally
/// Combining Sampling Techniques for Monte Carlo Rendering"), and diffuse rays everything else.

#include <algorithm>
#include <numbers>
#include <span>

#include "tracer/src/integrators/whitted/wavefront_state.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

/// Seeds of the random choices at a packet of hits. The samples of a pixel share one sequence for each choice and path,
/// so that their points are stratified together.
struct alignas(64) RandomPacket {
  std::uint64_t key[lanes];                 ///< hash of the pixel
  std::uint32_t index[lanes], path[lanes];  ///< index among the pixel's samples; hash of the bounces so far
};

struct alignas(64) PointLanes {
  double x[lanes], y[lanes];
};

/// Places at which light arrives.
struct alignas(64) ReceiverPacket {
  VecLanes origin;           ///< origin of all rays from there
  VecLanes normal, outward;  ///< shading and geometric normal on the side of the light
};

/// Random choices at a hit; area lights have their number, from 1.
enum class Choice : std::uint32_t { direction = 0xfffffff0u, emitter, branch, corner, side, patch, search, facet };

/// Numbers in [0,1) and points in [0,1)^2 for a choice.
void random_numbers(const RandomPacket& random, Choice choice, double* to);
void random_points(const RandomPacket& random, Choice choice, PointLanes& to);

/// Sets the seeds of the packet being shaded.
template <class Features>
void seed(const WavefrontState<Features>& state, const ShadingPointPacket& shading_points, RandomPacket& random) {
  for (int i = 0; i < state.hit.count; ++i) {
    const Batch::Sample& sample = state.batch.samples[shading_points.sample[i]];
    random.key[i] = sample.key;
    random.index[i] = sample.index;
    random.path[i] = state.termination.random_path(state.hit.path[i]);
  }
}

/// Hash of the bounces of a diffuse ray: beyond the keys of reflected and refracted rays.
WHITTLE_INLINE std::uint32_t diffuse_path(std::uint32_t path) {
  return static_cast<std::uint32_t>(mix(path | std::uint64_t{1} << 40));
}

/// Sets all but the origins and directions of diffuse rays, and the places on the incident side.
void begin_diffuse(const HitPacket& hit, const ShadingPointPacket& shading_points, SecondaryRayPacket& rays,
                   ReceiverPacket& places);

/// Directions around the normals and their densities per solid angle. Returns the lanes whose direction is above the
/// face.
LaneMask aim_diffuse(const ReceiverPacket& places, const PointLanes& points, VecLanes& directions, double* density);

/// Throughputs toward samples of emitters, beside diffuse rays that find these with the probability `search`. Returns
/// the lanes whose sample is above the surface.
LaneMask weigh_samples(const ReceiverPacket& places, const Emitters::SamplePacket& samples, const ColorLanes& diffuse,
                       const double* search, ColorLanes& throughput);

/// Keeps one ray at most in the lanes with a positive `weight`, selected in proportion to the throughput. Russian
/// roulette ends the path in the rest of the cases, so that its throughput stays `weight`. There are three or four.
void choose_branch(const double* weight, const double* random, std::span<SecondaryRayPacket* const> branches);

template <class Features>
class DiffuseRays {
 public:
  explicit DiffuseRays(WavefrontState<Features>& state) : state_(state) {}

  /// Sets the throughputs of the rays, and what the hit rays carry. Precondition: the shading points have theirs.
  /// `media_behind(lane)`: of the far side of a surface that lets diffuse light through. `trapped`: lanes with
  /// Termination::trapped_growth.
  template <class MediaBehind>
  void begin(const RayQueue& rays, const ShadingPointPacket& shading_points, const MediaBehind& media_behind,
             LaneMask trapped) {
    const HitPacket& hit = state_.hit;
    begin_diffuse(hit, shading_points, rays_, places_);
    after_diffuse_ = at_patch_ = 0;
    seed(state_, shading_points, random_);
    for (int i = 0; i < hit.count; ++i) {
      weight_[i] = rays.path_state(static_cast<std::size_t>(hit.ray[i])).weight *
                   ((trapped >> i & 1) != 0 ? state_.termination.trapped_growth : state_.termination.growth);
      after_diffuse_ |= lane_bit(i, weight_[i] > 0);
      media_[i] = shading_points.media[i];
    }
    const LaneMask transmits = hit.coefficients.transmits_light & first_lanes(hit.count);
    const LaneMask far_side = transmits == 0 ? 0 : choose_sides(transmits, shading_points, media_behind);
    far_side_ = far_side;
    if (state_.template needs<&Requirements::gouraud>()) move_to_corners(far_side);
    if (state_.patches() != nullptr) find_patches();
  }

  [[nodiscard]] SecondaryRayPacket& rays() { return rays_; }
  [[nodiscard]] const MediumStack::List* media() const { return media_; }
  /// Lanes that were hit after a diffuse bounce: they continue with one ray only.
  [[nodiscard]] LaneMask after_diffuse() const { return after_diffuse_; }
  /// PathState::weight of the ray that hit.
  [[nodiscard]] double weight(int lane) const { return weight_[lane]; }

  /// Adds a ray toward an emitter for each lane with a ray, and one that searches emitters for some of those that end
  /// at a patch. To be called before any of them is dropped by chance.
  void sample_emitters(const ShadingPointPacket& shading_points, RayQueue& to) {
    const LaneMask wanted = rays_.going | glossy_lanes();
    if (wanted == 0 || state_.scene.objects.emitters.empty()) return;
    PointLanes points;
    random_points(random_, Choice::emitter, points);
    Emitters::SamplePacket samples;
    state_.scene.objects.emitters.sample(places_.origin, points.x, points.y, wanted, samples);
    double search[lanes];
    std::fill_n(search, lanes, 1.0);
    for_each_lane(rays_.going & at_patch_,
                  [&](int i) { search[i] = state_.scene.objects.emitters.search_probability(places_.origin[i]); });
    ColorLanes throughput;
    LaneMask going = weigh_samples(places_, samples, rays_.throughput, search, throughput);
    for_each_lane(going & principled_lanes(), [&](int i) {
      const PrincipledHit& hit = state_.principled[i];
      const Vec3 direction = samples.direction[i];
      throughput.set(i, (rays_.going >> i & 1) != 0 ? throughput[i] * matt_factor(i, direction) : Color{});
      if ((glossy_lanes() >> i & 1) == 0) return;
      const double own = hit.point.density(direction);
      throughput.set(i, throughput[i] + hit.weight * hit.point.glossy(direction) *
                                            (1 / (std::numbers::pi * (own + samples.density[i]))));
    });
    going &= wanted;
    push_emission(shading_points, samples.direction, throughput, going, to,
                  [&](int i) { return PathState{.emitter = samples.primitive[i]}; });
    if ((rays_.going & at_patch_) != 0) search_emitters(shading_points, search, to);
  }

  /// Applies choose_branch() to the rays of all kinds.
  void choose_branches(SecondaryRayPacket& transmission, SecondaryRayPacket& reflection, SecondaryRayPacket& glossy) {
    if (after_diffuse_ == 0) return;
    double numbers[lanes];
    random_numbers(random_, Choice::branch, numbers);
    SecondaryRayPacket* const all[] = {&transmission, &reflection, &rays_, &glossy};
    choose_branch(weight_, numbers, std::span(all).first(state_.template needs<&Requirements::principled>() ? 4 : 3));
  }

  /// Ends the rays of lanes that have a patch. Its light takes their place, or the share of it that they bring is
  /// recorded.
  void end_at_patches(const ShadingPointPacket& shading_points) {
    for_each_lane(rays_.going & at_patch_, [&](int i) {
      const std::uint32_t sample = shading_points.sample[i];
      if (state_.terminations != nullptr) {
        state_.terminations->push_back({sample, TransportEntry(patch_[i], rays_.throughput[i])});
      } else {
        state_.radiance[sample] += rays_.throughput[i] * state_.scene.objects.radiosity->arriving[patch_[i]];
      }
    });
    rays_.going &= ~at_patch_;
  }

  /// Aims the rays. Light from below the face is dropped, as that of lights is.
  void aim() {
    if (rays_.going == 0) return;
    PointLanes points;
    random_points(random_, Choice::direction, points);
    rays_.origin = places_.origin;
    rays_.going &= aim_diffuse(places_, points, rays_.direction, density_);
    for_each_lane(rays_.going & principled_lanes(),
                  [&](int i) { rays_.throughput.set(i, rays_.throughput[i] * matt_factor(i, rays_.direction[i])); });
  }

  /// Principled lanes whose facets emitters are sampled for; those on the near side alone.
  [[nodiscard]] LaneMask glossy_lanes() const {
    LaneMask found = 0;
    for_each_lane(principled_lanes() & ~state_.hit.coefficients.transmits_light, [&](int i) {
      const PrincipledPoint& point = state_.principled[i].point;
      found |= lane_bit(i, !point.is_smooth());
    });
    return found;
  }

  /// State of the lane's ray. Precondition: aim() was called.
  [[nodiscard]] PathState path_state(int lane) const {
    return {.weight = weight_[lane] > 0 ? weight_[lane] : rays_.largest[lane],
            .density = state_.template needs<&Requirements::emitters>() ? density_[lane] : 0,
            .alpha = PrincipledSurface::blurred_alpha};
  }

 private:
  /// Lanes with a principled material, on the near side.
  [[nodiscard]] LaneMask principled_lanes() const {
    LaneMask found = 0;
    if (!state_.template needs<&Requirements::principled>()) return found;
    for (int i = 0; i < state_.hit.count; ++i) found |= lane_bit(i, !is_black(state_.principled[i].weight));
    return found & ~far_side_;
  }

  /// Matt reflection of light from there over its mean.
  [[nodiscard]] Color matt_factor(int lane, const Vec3& direction) const {
    const PrincipledPoint& point = state_.principled[lane].point;
    const Color there = point.matt(dot(places_.normal[lane], direction)), mean = point.matt_albedo();
    const auto over = [](double value, double by) { return by > 0 ? value / by : 0; };
    return {over(there.r, mean.r), over(there.g, mean.g), over(there.b, mean.b)};
  }

  template <class StateOfLane>
  void push_emission(const ShadingPointPacket& shading_points, const VecLanes& direction, const ColorLanes& throughput,
                     LaneMask going, RayQueue& to, const StateOfLane& state_of_lane) {
    if (going == 0) return;
    std::size_t next = to.size();
    to.append({places_.origin, direction, &throughput, shading_points.sample, shading_points.from, rays_.path, media_},
              going);
    for_each_lane(going, [&](int i) { to.set_path_state(next++, state_of_lane(i)); });
    if (state_.template needs<&Requirements::filtered_textures>()) to.set_cone({});
  }

  /// From lanes that end at a patch no ray continues: with these probabilities one brings the emission of emitters.
  void search_emitters(const ShadingPointPacket& shading_points, const double* probability, RayQueue& to) {
    double numbers[lanes], density[lanes];
    random_numbers(random_, Choice::search, numbers);
    LaneMask going = 0;
    for_each_lane(rays_.going & at_patch_, [&](int i) { going |= lane_bit(i, numbers[i] < probability[i]); });
    if (going == 0) return;
    PointLanes points;
    VecLanes direction;
    ColorLanes throughput;
    random_points(random_, Choice::direction, points);
    going &= aim_diffuse(places_, points, direction, density);
    for_each_lane(going, [&](int i) { throughput.set(i, rays_.throughput[i] * (1 / probability[i])); });
    for_each_lane(going & principled_lanes(),
                  [&](int i) { throughput.set(i, throughput[i] * matt_factor(i, direction[i])); });
    push_emission(shading_points, direction, throughput, going, to,
                  [&](int i) { return PathState{.density = density[i] * probability[i]}; });
  }

  /// Finds the patches of the lanes whose rays end there: all, or those after a diffuse bounce.
  void find_patches() {
    PointLanes beside;
    random_points(random_, Choice::patch, beside);
    const PointPacket& points = state_.hit.points;
    for_each_lane(state_.gathers() ? rays_.going & after_diffuse_ : rays_.going, [&](int i) {
      Vec3 normal = places_.normal[i];
      if (state_.template needs<&Requirements::bump>()) {  // patches have unperturbed normals
        normal = points.smooth ? points.normal[i] : points.face[i];
        if (dot(normal, places_.outward[i]) < 0) normal = -normal;
      }
      patch_[i] = state_.patches()->find(points.object[i], places_.origin[i], normal, {beside.x[i], beside.y[i]});
      at_patch_ |= lane_bit(i, patch_[i] != PatchGrid::none);
    });
  }

  /// Selects one side of each surface that light comes through, in proportion to the light that is kept there. Returns
  /// the lanes on the far side.
  template <class MediaBehind>
  LaneMask choose_sides(LaneMask transmits, const ShadingPointPacket& shading_points, const MediaBehind& media_behind) {
    const HitPacket& hit = state_.hit;
    double numbers[lanes];
    random_numbers(random_, Choice::side, numbers);
    LaneMask far_side = 0;
    for_each_lane(transmits, [&](int i) {
      const Color near = shading_points.diffuse[i];
      const Color far = hit.throughput[i] * hit.coefficients.diffuse_transmission[i];
      const double of_near = max_component(near), of_far = max_component(far), sum = of_near + of_far;
      if (!(of_far > 0)) return;
      const bool is_far = numbers[i] * sum < of_far;
      rays_.throughput.set(i, is_far ? far * (sum / of_far) : near * (sum / of_near));
      rays_.largest[i] = sum;
      rays_.going |= lane_bit(i);
      if (!is_far) return;
      far_side |= lane_bit(i);
      media_[i] = media_behind(i);
      move(i, {hit.points.position[i], hit.points.error[i]}, -places_.normal[i], -places_.outward[i]);
    });
    return far_side;
  }

  /// On triangles that are lit at their vertices light arrives at one of these, selected in proportion to its
  /// barycentric coordinate, or at the centroid.
  void move_to_corners(LaneMask far_side) {
    double numbers[lanes];
    random_numbers(random_, Choice::corner, numbers);
    for_each_lane(rays_.going, [&](int i) {
      const Material::Shading shading = shading_of(state_.material_of_lane(i).shading, state_.approximate().shading);
      if (!is_lit_by_triangle(shading) || state_.material_of_lane(i).principled) return;
      const Hit at = state_.hits.at(static_cast<std::size_t>(state_.hit.ray[i]));
      const auto corners = corners_at(state_.scene, at);
      if (!corners) return;
      const bool back = state_.hit.back_face[i] > 0, far = (far_side >> i & 1) != 0;
      const double side = back != far ? -1 : 1;
      if (shading == Material::Shading::flat_polygon)
        if (const auto centroid = centroid_at(state_.scene, at))
          return move(i, centroid->point, centroid->normal * side, places_.outward[i]);
      const Corner* chosen = corners->data();
      for (const Corner& corner : *corners) {
        chosen = &corner;
        if ((numbers[i] -= corner.weight) < 0) break;
      }
      move(i, chosen->point, chosen->normal * side, places_.outward[i]);
    });
  }

  void move(int lane, const BoundedPoint& point, const Vec3& normal, const Vec3& outward) {
    places_.origin.set(lane, offset_origin(point, outward, outward));
    places_.normal.set(lane, normal);
    places_.outward.set(lane, outward);
  }

  WavefrontState<Features>& state_;
  RandomPacket random_ = {};
  ReceiverPacket places_;
  SecondaryRayPacket rays_ = {};
  LaneMask after_diffuse_ = 0, at_patch_ = 0, far_side_ = 0;
  std::uint32_t patch_[lanes] = {};
  MediumStack::List media_[lanes] = {};
  double weight_[lanes] = {}, density_[lanes] = {};
};

}  // namespace tracer
