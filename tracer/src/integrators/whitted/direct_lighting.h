#pragma once
/// Direct lighting: evaluates every light at every shading point of a queue and traces the shadow rays.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/integrators/whitted/wavefront_state.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

/// Unoccluded direct lighting of one light at 16 shading points, lane by lane with a ShadingPointPacket. From
/// `highlight` on undefined if no lane is lit.
struct alignas(64) LightSamplePacket {
  VecLanes from;  ///< input: points of the light, unless it is directional

  VecLanes to_light;        ///< unit
  double distance[lanes];   ///< render space; infinite for directional lights
  double cosine[lanes];     ///< N.L
  double strength[lanes];   ///< `share` after attenuation and the spot's cone
  double highlight[lanes];  ///< specular cosine, then its power
  ColorLanes radiance;      ///< added to the sample if not occluded
  LaneMask lit;             ///< lanes that receive light

  VecLanes origin;  ///< origin of the shadow ray
  // Its direction and distance. Undefined unless the shading points are smooth: they are `to_light` and `distance`.
  VecLanes shadow_direction;
  double shadow_distance[lanes];
};

/// Evaluates the fraction `share` of `light`. `world_per_render` converts render-space distances to world space.
/// `principled`: by hit, empty if no material is principled.
void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light, double world_per_render,
                  double share, std::span<const PrincipledHit> principled, LightSamplePacket& sample);
/// The same for packets of the far side.
void sample_light_behind(const ShadingPointPacket& shading_points, const CompiledLight& light, double world_per_render,
                         double share, std::span<const PrincipledHit> principled, LightSamplePacket& sample);

/// Shadow rays from shading points to one light, and their transmittance.
class ShadowRays {
 public:
  ShadowRays(const CompiledScene& scene, const RenderControl& control, const Requirements& needs)
      : scene_(scene), control_(control), needs_(needs) {}

  void clear() { rays_.clear(); }
  /// Appends the lit lanes of `packet`.
  void append(const ShadingPointPacket& packet, const LightSamplePacket& sample);
  [[nodiscard]] std::size_t size() const { return rays_.size(); }

  /// Traces all rays and adds their radiance to the samples, in the order of append().
  void add_unoccluded(std::vector<Color>& radiance, MediumStack& media, Coherence coherence);
  /// Adds the results of add_unoccluded() to the signatures of the samples.
  void sign(std::vector<SampleSignature>& signatures, std::uint32_t depth, std::uint32_t light) const {
    for (std::size_t i = 0; i < rays_.size(); ++i)
      signatures[rays_.sample(i)].add_light(
          light, depth, blocked_[i] == 0 && (!needs_.transmissive_shadows || transmittance_[i] == Color{1, 1, 1}));
  }

 private:
  /// Remaining parts of shadow rays. `number`: index of the shadow ray.
  struct RaySegments {
    const RayQueue& rays;
    const double* distance;
    const std::uint32_t* number;
  };

  void attenuate_transmissive(MediumStack& media);
  void cross_next_surface(const RaySegments& from, MediumStack& media);
  void cross_packet(const RaySegments& from, MediumStack& media);
  [[nodiscard]] Color textured_transmittance(int lane) const;

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Requirements& needs_;
  RayQueue rays_;
  std::vector<double> distance_;  ///< parallel to rays_, possibly longer
  std::vector<std::uint8_t> blocked_;
  std::vector<Color> transmittance_;   ///< S_i: product over the crossed surfaces
  std::vector<std::uint32_t> number_;  ///< 0, 1, ...

  // Segments behind a transmissive surface, and those of the next step.
  RayQueue crossing_, next_;  ///< `sample` is the shadow ray's number
  std::vector<double> crossing_distance_, next_distance_;
  Hits crossed_;
  std::vector<std::uint32_t> hit_rays_;  ///< rays that crossed a surface; possibly longer
  IntersectionPacket intersections_;
};

/// Selects the nearest lights of each hit.
class NearestLights {
 public:
  /// Selects `count` >= 1 lights for each hit, by the distance of their centers, then by their order in the scene.
  /// Directional lights are always included and not counted.
  void choose(const std::vector<CompiledLight>& lights, const std::vector<Vec3>& hits, std::uint32_t count) {
    is_directional_.clear();
    centers_.clear();
    for (const CompiledLight& light : lights) {
      is_directional_.push_back(light.kind == light_kind<DirectionalLight> ? 1 : 0);
      centers_.push_back(light_center(light));
    }
    position_ = hits;
    last_rank_.clear();
    for (const Vec3& position : position_) last_rank_.push_back(last_rank(position, count));
  }

  [[nodiscard]] bool includes(std::size_t hit, std::uint32_t number) const {
    return is_directional_[number] != 0 || rank(position_[hit], number) <= last_rank_[hit];
  }

 private:
  using Rank = std::pair<double, std::uint32_t>;  ///< squared distance, then number of the light

  [[nodiscard]] Rank rank(const Vec3& position, std::uint32_t number) const {
    const Vec3 offset = centers_[number] - position;
    return {dot(offset, offset), number};
  }

  Rank last_rank(const Vec3& position, std::uint32_t count) {
    ranks_.clear();
    for (std::uint32_t number = 0; number < centers_.size(); ++number)
      if (is_directional_[number] == 0) ranks_.push_back(rank(position, number));
    if (ranks_.size() <= count)
      return {std::numeric_limits<double>::infinity(), std::numeric_limits<std::uint32_t>::max()};
    const auto last = ranks_.begin() + (count - 1);
    std::nth_element(ranks_.begin(), last, ranks_.end());
    return *last;
  }

  std::vector<std::uint8_t> is_directional_;  ///< by light
  std::vector<Vec3> centers_;                 ///< by light
  std::vector<Vec3> position_;                ///< by hit
  std::vector<Rank> last_rank_;               ///< rank of the farthest included light, by hit
  std::vector<Rank> ranks_;
};

/// One point of one light, sampled at all shading points.
struct LightPass {
  const CompiledLight& light;
  std::uint32_t number = 0;  ///< index of the light
  std::uint32_t point = 0, points = 1;
  double budget = 0;        ///< radiance that may be culled at one hit after lights 0..number; see cull()
  std::uint32_t depth = 0;  ///< bounces of the rays
};

template <class Features>
class DirectLighting {
 public:
  explicit DirectLighting(WavefrontState<Features>& state)
      : state_(state), shadow_(state.scene, state.control, state.requirements) {}

  /// Starts a queue with `state.hit_rays`.
  void reset() {
    shading_points_.clear();
    corner_points_.clear();
    far_points_.clear();
    position_.clear();
    principled_.clear();
    if (state_.template needs<&Requirements::bump>()) unperturbed_normal_.assign(state_.hit_rays.size(), {});
  }

  ShadingPointPacket& append_packet() { return shading_points_.append_packet(); }

  /// Normals before bump and normal maps, by hit; zero where they are not perturbed. Empty in scenes without maps.
  [[nodiscard]] std::vector<Vec3>& unperturbed_normals() { return unperturbed_normal_; }

  /// Stores the principled hits of the packet.
  void add_principled() { std::copy_n(state_.principled, state_.hit.count, std::back_inserter(principled_)); }

  /// Stores the positions of the packet's hits if only the nearest lights count.
  void add_positions() {
    if (state_.approximate().nearest_lights == 0) return;
    for (int i = 0; i < state_.hit.count; ++i) position_.push_back(state_.hit.points.position[i]);
  }

  /// Moves the lanes that are lit by triangle to its vertices or its centroid. `depth`: that of the rays.
  void move_to_vertices(const RayQueue& rays, std::uint32_t depth, ShadingPointPacket& shading_points) {
    if (!state_.template needs<&Requirements::gouraud>()) return;
    for (int i = 0; i < state_.hit.count; ++i) {
      const ShadingPoint near{.face = shading_points.face[i],
                              .diffuse = shading_points.diffuse[i],
                              .specular = shading_points.any_specular ? shading_points.specular[i] : Color{},
                              .shininess = state_.material_of_lane(i).shininess,
                              .blinn = state_.material_of_lane(i).blinn,
                              .hit = shading_points.hit[i],
                              .sample = shading_points.sample[i],
                              .media = shading_points.media[i],
                              .from = shading_points.from[i]};
      if (!push_vertices(rays, depth, near, i, corner_points_)) continue;
      // Textures do not perturb the normals of vertices.
      if (state_.template needs<&Requirements::bump>()) unperturbed_normal_[shading_points.hit[i]] = {};
      shading_points.diffuse.set(i, {});
      shading_points.specular.set(i, {});
    }
  }

  /// Adds the far sides of the lanes that light comes through. `far_side_of(lane)`: SecondaryRays::FarSide. Must be
  /// called before move_to_vertices().
  template <class FarSideOf>
  void add_far_sides(const RayQueue& rays, std::uint32_t depth, const ShadingPointPacket& near,
                     const FarSideOf& far_side_of) {
    const HitPacket& hit = state_.hit;
    for_each_lane(hit.coefficients.transmits_light & first_lanes(hit.count), [&](int i) {
      const CompiledMaterial& material = state_.material_of_lane(i);
      const auto [media, eta] = far_side_of(i);
      const bool smooth_front = hit.points.smooth && hit.back_face[i] > 0;
      const ShadingPoint far{.point = {near.position[i], hit.points.error[i]},
                             .face = near.face[i],
                             .normal = -near.normal[i],
                             .to_eye = near.to_eye[i],
                             .diffuse = hit.throughput[i] * hit.coefficients.diffuse_transmission[i],
                             .specular = hit.throughput[i] * hit.coefficients.specular_transmission[i],
                             .shininess = material.blinn ? material.shininess / 4 : material.shininess,
                             .far_side = true,
                             .eta = eta,
                             .hit = near.hit[i],
                             .shadow_offset = smooth_front ? hit.points.offset[i] : Vec3{},
                             .sample = near.sample[i],
                             .media = media,
                             .from = near.from[i]};
      if (state_.template needs<&Requirements::gouraud>() && push_vertices(rays, depth, far, i, far_points_)) return;
      far_points_.push(far);
    });
  }

  /// Adds the light of all lights to the samples. Area lights have the batch's number of points at hits of camera rays
  /// and one point after a bounce.
  void shade(const RayQueue& rays, std::uint32_t depth, Coherence coherence) {
    const CompiledScene& scene = state_.scene;
    const bool many_lights = state_.template needs<&Requirements::many_lights>();
    const std::uint32_t light_points = depth == 0 ? state_.batch.light_points : 1;
    const double cutoff = scene.accuracy.cutoff.value_or(0);
    const double budget = cutoff / static_cast<double>(scene.lights.size());
    culled_radiance_.assign(many_lights ? state_.hit_rays.size() : 0, 0);
    const std::uint32_t nearest = state_.approximate().nearest_lights;
    if (nearest != 0) nearest_.choose(scene.lights, position_, nearest);
    for (std::uint32_t number = 0; number < scene.lights.size(); ++number) {
      const CompiledLight& light = scene.lights[number];
      const std::uint32_t points = light.is_area_light() ? light_points : 1;
      for (std::uint32_t point = 0; point < points; ++point) {
        if (state_.control.cancelled()) return;
        const double lights_done = number + (point + 1.0) / points;
        shade_light(rays, {light, number, point, points, budget * lights_done, depth}, coherence);
      }
    }
    for (const double culled : culled_radiance_)
      if (culled > 0)
        state_.statistics.culled_radiance += static_cast<std::uint64_t>(std::ceil(culled / cutoff * 0x1p20));
  }

 private:
  /// Pushes `at_hit`, moved to the vertices or the centroid. Returns false unless the lane is lit by triangle.
  bool push_vertices(const RayQueue& rays, std::uint32_t depth, const ShadingPoint& at_hit, int lane,
                     ShadingPointQueue& to) {
    const HitPacket& hit = state_.hit;
    const Material::Shading shading = shading_of(state_.material_of_lane(lane).shading, state_.approximate().shading);
    if (!is_lit_by_triangle(shading) || state_.material_of_lane(lane).principled) return false;
    const auto ray = static_cast<std::size_t>(hit.ray[lane]);
    const std::optional<Corners> corners = corners_at(state_.scene, state_.hits.at(ray));
    if (!corners) return false;
    const std::optional<Corner> centroid =
        shading == Material::Shading::flat_polygon ? centroid_at(state_.scene, state_.hits.at(ray)) : std::nullopt;
    // Only these rays begin at the eye; any other could begin elsewhere on its line.
    const bool from_eye = depth == 0 && !state_.scene.camera.has_parallel_rays();
    const bool reverses = (hit.back_face[lane] > 0) != at_hit.far_side;
    for (const Corner& corner : centroid ? std::span(&*centroid, 1) : std::span<const Corner>(*corners)) {
      ShadingPoint vertex = at_hit;
      vertex.point = corner.point;
      vertex.normal = reverses ? -corner.normal : corner.normal;
      vertex.to_eye = from_eye ? normalize(rays.origin(ray) - corner.point.position) : -rays.direction(ray);
      vertex.diffuse = at_hit.diffuse * corner.weight;
      vertex.specular = at_hit.specular * corner.weight;
      vertex.shadow_offset = {};
      to.push(vertex);
    }
    return true;
  }

  void shade_light(const RayQueue& rays, const LightPass& pass, Coherence coherence) {
    shadow_.clear();
    if (!pass.light.is_area_light()) set_light_points(lanes, [&](int) { return pass.light.position; });
    for (const ShadingPointQueue* queue : {&shading_points_, &corner_points_, &far_points_})
      for (std::size_t i = 0; i < queue->packets(); ++i) shade_packet(rays, pass, queue->packet(i));
    state_.statistics.rays.shadow += shadow_.size();
    shadow_.add_unoccluded(state_.radiance, state_.media, coherence);
    if (!state_.signatures.empty()) shadow_.sign(state_.signatures, pass.depth, pass.number);
  }

  void shade_packet(const RayQueue& rays, const LightPass& pass, const ShadingPointPacket& packet) {
    if (pass.light.is_area_light())
      set_light_points(packet.count,
                       [&](int lane) { return sample_area_light(pass, rays, state_.hit_rays[packet.hit[lane]]); });
    const bool far_side = state_.template needs<&Requirements::transmitted_light>() && packet.far_side;
    const auto sample = far_side ? sample_light_behind : sample_light;
    sample(packet, pass.light, state_.scene.frame.world_from_render(1.0), 1.0 / pass.points, principled_,
           light_sample_);
    // One test for a packet in a scene without any of these features.
    const bool filters = !pass.light.shadows || state_.may_cull_shadow_rays() ||
                         state_.approximate().nearest_lights != 0 || state_.template needs<&Requirements::bump>();
    if (filters)
      for_each_lane(light_sample_.lit, [&](int lane) {
        if (!needs_shadow_ray(rays, pass, packet, lane)) light_sample_.lit &= ~lane_bit(lane);
      });
    if (light_sample_.lit != 0) shadow_.append(packet, light_sample_);
  }

  /// The points of a light that is not an area light stay from packet to packet.
  template <class PointOfLane>
  void set_light_points(int count, const PointOfLane& point_of_lane) {
    for (int lane = 0; lane < count; ++lane) light_sample_.from.set(lane, point_of_lane(lane));
  }

  /// The samples of a pixel share one sequence per light and path, so that their points are stratified together. It is
  /// shuffled, since the same index selected the position in the pixel.
  [[nodiscard]] Vec3 sample_area_light(const LightPass& pass, const RayQueue& rays, std::size_t ray) const {
    const Batch::Sample& sample = state_.batch.samples[rays.sample(ray)];
    const std::uint64_t dimension = (std::uint64_t{rays.path(ray)} << 32) | (pass.number + 1);
    return light_point(pass.light,
                       shuffled_point(sample.index * pass.points + pass.point, mix(sample.key ^ mix(dimension))));
  }

  /// Returns true if a shadow ray decides about the light of this lane. Otherwise the lane receives all of it (a light
  /// without shadows, or approximately visible) or nothing: a light that is not among the nearest, negligible light, or
  /// light from behind the unperturbed surface. noinline: most scenes need none of this.
  __attribute__((noinline)) bool needs_shadow_ray(const RayQueue& rays, const LightPass& pass,
                                                  const ShadingPointPacket& packet, int lane) {
    const std::size_t hit = packet.hit[lane];
    const Vec3 to_light = light_sample_.to_light[lane];
    const auto sign = [&](bool reaches) {
      if (!state_.signatures.empty())
        state_.signatures[packet.sample[lane]].add_light(pass.number, pass.depth, reaches);
      return reaches;
    };
    if (state_.approximate().nearest_lights != 0 && !nearest_.includes(hit, pass.number)) return sign(false);
    if (state_.template needs<&Requirements::bump>() &&
        dot(unperturbed_normal_[hit], packet.far_side ? -to_light : to_light) < 0)
      return false;
    const bool exact = state_.approximate().shadows == Approximations::Shadows::exact;
    if (pass.light.shadows && exact) return !state_.may_cull_shadow_rays() || !cull(rays, pass, packet, lane);
    if (!pass.light.shadows || sign(approximately_visible(pass, packet, lane)))
      state_.radiance[packet.sample[lane]] += light_sample_.radiance[lane];
    return false;
  }

  /// Culls the shadow ray if the unoccluded light is small. The lights share `cutoff` at each hit: each may use its own
  /// share and what the lights before it did not use. Without `cutoff` chance decides: a ray is traced in proportion to
  /// its light, and then has the light `kept`. A thousand lights of half of it have a deviation of 0.1 %.
  bool cull(const RayQueue& rays, const LightPass& pass, const ShadingPointPacket& packet, int lane) {
    const std::size_t hit = packet.hit[lane], ray = state_.hit_rays[hit];
    const std::optional<double>& cutoff = state_.scene.accuracy.cutoff;
    const double radiance = max_component(light_sample_.radiance[lane]), culled = culled_radiance_[hit] + radiance;
    if (cutoff && !(culled <= pass.budget)) return false;
    if (cutoff) culled_radiance_[hit] = culled;
    if (!cutoff || state_.batch.lifted.cutoff) {
      const double kept = cutoff.value_or(1e-3) / 16;
      if (radiance >= kept) return false;
      const Batch::Sample& seeds = state_.batch.samples[packet.sample[lane]];
      const std::uint64_t light = std::uint64_t{rays.path(ray)} << 32 | (pass.number * pass.points + pass.point);
      const std::uint64_t random = mix(mix(seeds.key ^ mix(seeds.index + 1)) ^ mix(~light));
      if (static_cast<double>(random >> 11) * 0x1p-53 * kept < radiance) {
        light_sample_.radiance.set(lane, light_sample_.radiance[lane] * (kept / radiance));
        return false;
      }
    } else {
      state_.omitted[packet.sample[lane]] += static_cast<float>(radiance);
    }
    ++state_.statistics.culled_shadow_rays;
    return true;
  }

  /// Visibility without shadows, or by the light's shadow map; planes are not in the map and are tested themselves.
  [[nodiscard]] bool approximately_visible(const LightPass& pass, const ShadingPointPacket& packet, int lane) const {
    if (state_.approximate().shadows == Approximations::Shadows::none) return true;
    if (!state_.scene.shadow_maps[pass.number].lit(packet.shadow_start(lane), packet.face[lane])) return false;
    const LightSamplePacket& sample = light_sample_;
    const Vec3 direction = packet.smooth ? sample.shadow_direction[lane] : sample.to_light[lane];
    const double distance = packet.smooth ? sample.shadow_distance[lane] : sample.distance[lane];
    const double t_max = distance * (1 - 0x1p-40);  // as shadow rays
    return !plane_between(state_.scene.geometry(), sample.origin[lane], direction, t_max, packet.from[lane]);
  }

  WavefrontState<Features>& state_;
  ShadingPointQueue shading_points_;       ///< the hits, packet by packet
  ShadingPointQueue corner_points_;        ///< vertices or centroids of triangles, three or one for a hit
  ShadingPointQueue far_points_;           ///< far sides of hits that light comes through, or of their vertices
  std::vector<Vec3> unperturbed_normal_;   ///< by hit; empty in scenes without bump and normal maps
  std::vector<PrincipledHit> principled_;  ///< by hit; empty unless a material is principled
  std::vector<Vec3> position_;             ///< by hit; empty unless only the nearest lights count
  std::vector<double> culled_radiance_;    ///< by hit; empty unless the scene has many lights
  NearestLights nearest_;
  LightSamplePacket light_sample_;  ///< one light at one packet
  ShadowRays shadow_;
};

}  // namespace tracer
