#pragma once
/// Traces batches of samples generation by generation: a queue of rays is intersected, its hits are gathered, shading
/// adds light and fills the queues of the next generation. No recursion, so depth costs no memory by itself.

#include <cstdint>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/integrators/feature_set.h"
#include "tracer/src/integrators/whitted/bounce_queues.h"
#include "tracer/src/integrators/whitted/light_samples.h"
#include "tracer/src/integrators/whitted/nearest_lights.h"
#include "tracer/src/integrators/whitted/secondary_ray_packet.h"
#include "tracer/src/integrators/whitted/shadow_rays.h"
#include "tracer/src/interaction/gbuffer.h"
#include "tracer/src/interaction/uv_gradients.h"

namespace tracer {

/// Samples of the image to be traced together, one camera ray each; see camera_rays.h.
struct Batch {
  /// What the random choices of a sample are derived from.
  struct Sample {
    std::uint64_t key = 0;    ///< of its pixel
    std::uint32_t index = 0;  ///< among the pixel's samples
  };
  std::vector<Sample> samples;
  std::vector<double> x, y;        ///< beside samples: where in the full image, in pixels
  std::vector<Vec2> lens;          ///< beside samples: where on the lens, in [0,1)^2; empty in scenes without one
  std::vector<double> share;       ///< beside samples: of the pixel's width; empty where no texture is filtered
  std::uint32_t light_points = 1;  ///< by which a soft light is known to what a camera ray hits; after a bounce, one

  /// Keeps the memory for the next samples.
  void clear() {
    samples.clear();
    x.clear();
    y.clear();
    lens.clear();
    share.clear();
    light_points = 1;
  }
};

/// What a sample lacks, largest channel.
struct OmittedRadiance {
  float depth = 0;   ///< weight of the branches that `max_depth` ended
  float cutoff = 0;  ///< weight of those that `cutoff` ended
  float culled = 0;  ///< radiance that shadow rays were not traced for
};

/// One of the points by which a light is known to a hit.
struct LightStep {
  const CompiledLight& light;
  std::uint32_t number = 0;  ///< of the light
  std::uint32_t point = 0, points = 1;
  double budget = 0;  ///< of a hit's light may be missing once this step is done; see spares
};

/// One thread's tracer with its scratch memory. Contributions to one sample are added in an order that depends on that
/// sample alone (generation, then kind, then the order of the parents, then light), so no choice of batch, tile or
/// thread changes a bit of the image.
template <class Model>
class Wavefront {
 public:
  /// `approximations` are the scene's, or none: then the samples are exact.
  Wavefront(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : scene_(scene),
        control_(control),
        approximations_(approximations),
        needs_(approximations == scene.accuracy.approximate ? scene.needs : scene.exact_needs),
        media_(scene),
        shadow_(scene, control, needs_) {}

  /// What to trace next, for the caller to fill. It is as the caller left it, samples traced or not.
  [[nodiscard]] Batch& batch() { return batch_; }
  /// Traces the batch to the end. False: cancelled; then the radiances mean nothing. Throws std::bad_alloc.
  bool trace();

  /// Radiance of each sample of the last batch. May hold non-finite values.
  [[nodiscard]] const std::vector<Color>& radiance() const { return radiance_; }
  /// What each sample lacks; empty in scenes where none can lack anything.
  [[nodiscard]] const std::vector<OmittedRadiance>& omitted() const { return omitted_; }
  /// What its camera rays hit; kept when the scene needs a depth cue or layers.
  [[nodiscard]] const GBuffer& gbuffer() const { return gbuffer_; }
  /// Of all batches so far.
  [[nodiscard]] const RenderStatistics& statistics() const { return statistics_; }

 private:
  /// Whether the scene needs it; false while it is compiled where the model does not hold it.
  template <bool Requirements::*need>
  [[nodiscard]] bool needs() const {
    if constexpr (Model::holds(need)) {
      return needs_.*need;
    } else {
      return false;
    }
  }
  [[nodiscard]] bool may_omit_radiance() const {
    return needs<&Requirements::reflection>() || needs<&Requirements::refraction>() ||
           needs<&Requirements::many_lights>() || approximate().reflections == Approximations::Reflections::environment;
  }
  [[nodiscard]] Approximations approximate() const {
    if constexpr (Model::holds(&Requirements::approximations)) {
      return approximations_;
    } else {
      return {};
    }
  }
  /// Whether there may be another answer to a shadow than its ray. One test for every hit and light.
  [[nodiscard]] bool may_cull_shadow_rays() const {
    if constexpr (Model::holds(&Requirements::approximations) || Model::holds(&Requirements::many_lights)) {
      return may_cull_shadow_rays_;
    } else {
      return false;
    }
  }
  [[nodiscard]] bool writes_gbuffer() const {
    return needs<&Requirements::depth_cue>() || needs<&Requirements::layers>();
  }

  // tracing.h
  void generate_camera_rays(RayQueue& rays) const;
  [[nodiscard]] BounceQueues acquire_queues(std::uint32_t depth);
  void release_queues(BounceQueues generation);
  void trace_bounce(const BounceQueues& generation, BounceQueues& next);
  void process_queue(const RayQueue& rays, std::uint32_t depth, BounceQueues& next);
  void intersect(const RayQueue& rays, std::uint32_t depth, Coherence coherence);
  [[nodiscard]] Color throughput_at_hit(const RayQueue& rays, std::size_t ray) const;
  void handle_escaped_rays(const RayQueue& rays, std::uint32_t depth);
  void write_gbuffer_depths(const RayQueue& rays);
  void apply_depth_cue();

  // shading.h: hits, packet by packet
  void shade_hits(const RayQueue& rays, std::uint32_t depth, BounceQueues& next);
  void absorb(const RayQueue& rays);
  void flatten();
  void find_colors(const RayQueue& rays, ShadingPointPacket& shading_point);
  void write_gbuffer(const ShadingPointPacket& shading_point);
  void face_from_corners(const RayQueue& rays, ShadingPointPacket& shading_point);
  [[nodiscard]] bool face_at_corners(const RayQueue& rays, const ShadingPointPacket& shading_point, int lane);
  [[nodiscard]] const CompiledMaterial& compiled_material_of_lane(int lane) const {
    return scene_.terms[hit_.material[lane]];
  }
  [[nodiscard]] Surface surface_of_lane(const ShadingPointPacket& shading_point, int lane) const;
  [[nodiscard]] Color color_of_lane(int lane) const;
  struct TextureOf {
    const Texture& texture;
    const ImageMap* image;
  };
  [[nodiscard]] TextureOf texture_of(TextureId id) const;
  [[nodiscard]] Vec2 covered_of(const RayQueue& rays, std::size_t ray, const Surface& surface,
                                const Texture& texture) const;

  // bending.h: bump and normal maps
  void perturb_normals(const RayQueue& rays, ShadingPointPacket& shading_point);

  // lighting.h: the local model
  void shade_lights(const RayQueue& rays, std::uint32_t depth, Coherence coherence);
  void shade_light(const RayQueue& rays, const LightStep& step, Coherence coherence);
  void light_packet(const RayQueue& rays, const LightStep& step, const ShadingPointPacket& packet);
  void place_light(const LightStep& step, const RayQueue& rays, const ShadingPointPacket* packet);
  bool needs_shadow_ray(const RayQueue& rays, const LightStep& step, const ShadingPointPacket& packet, int lane);
  [[nodiscard]] bool approximately_visible(const LightStep& step, const ShadingPointPacket& packet, int lane,
                                           const Vec3& to_light, const Vec3& origin) const;
  bool is_negligible(const RayQueue& rays, std::size_t hit, const LightStep& step, const Color& contribution);
  [[nodiscard]] Vec3 sample_area_light(const LightStep& step, const RayQueue& rays, std::size_t ray) const;

  // branching.h: mirrors and glass
  void cross_media(const ShadingPointPacket& shading_point);
  void branch(const RayQueue& rays, const ShadingPointPacket& shading_point, BounceQueues& next);
  void skip_nested_boundary(const RayQueue& rays);
  void cut(SecondaryRayPacket& branches, std::uint64_t which, const ShadingPointPacket& shading_point, int lane);
  double survives(double largest, std::uint32_t sample, std::uint64_t bounce);
  void truncate(double largest, std::uint32_t sample);
  void add_environment_radiance(const RayQueue& rays, const SecondaryRayPacket& branches, int lane,
                                std::uint32_t sample);
  [[nodiscard]] RayCone cone_of(const RayQueue& rays, const SecondaryRayPacket& branches, int lane) const;
  void send(const RayQueue& rays, const SecondaryRayPacket& branches, const ShadingPointPacket& shading_point,
            const MediumStack::List* media, RayQueue& to);

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Approximations approximations_;
  const Requirements& needs_;
  const bool may_cull_shadow_rays_ = needs_.many_lights || approximations_.shadows != Approximations::Shadows::exact;
  RenderStatistics statistics_;
  std::vector<Color> radiance_;
  std::vector<OmittedRadiance> omitted_;
  Batch batch_;
  GBuffer gbuffer_;
  MediumStack media_;

  // Answers of the queue being shaded.
  Hits hits_;                            ///< one per ray
  std::vector<std::uint32_t> hit_ray_;   ///< which rays of the queue hit something
  std::vector<std::uint32_t> missed_;    ///< and which nothing
  std::vector<double> culled_radiance_;  ///< light whose shadow rays were spared, beside hit_ray_; for many lights
  std::vector<Vec3>
      unperturbed_normal_;      ///< empty in scenes without bent normals; beside hit_ray_, zero where not bent
  std::vector<Vec3> position_;  ///< beside hit_ray_, where not all lights count

  HitPacket hit_;                 ///< the packet of hits being shaded
  Vec2 uv_[lanes] = {};           ///< where it is textured
  CoveredPacket covered_ = {};    ///< and filtered
  LaneMask nested_boundary_ = 0;  ///< its lanes that hide within a solid of higher priority, and weigh nothing
  MediumStack::List medium_after_[lanes] = {};  ///< the solids beyond the surfaces that let light through
  InterfacePacket interfaces_;                  ///< and the indices there
  SecondaryRayPacket mirrored_, through_;       ///< what goes on from the packet
  NearestLights nearest_;                       ///< of each hit, where not all lights count
  ShadingPointQueue shading_points_;            ///< the hits' places, packet by packet
  ShadingPointQueue corner_points_;             ///< of triangles that are lit at their corners instead, three for a hit
  LightSamplePacket light_sample_;              ///< of one light at one packet of them

  ShadowRays shadow_;
  std::vector<BounceQueues> released_queues_;  ///< traced ones, for the memory that they hold
};

}  // namespace tracer
