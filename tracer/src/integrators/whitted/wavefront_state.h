#pragma once
/// Feature sets of the Whitted integrator, and the state of a batch that its stages share: the scene, the results, the
/// queue and the packet of hits being shaded.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

#include "tracer/render.h"
#include "tracer/requirements.h"
#include "tracer/src/compiled/medium_stack.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/integrators/whitted/intersection_packet.h"
#include "tracer/src/radiosity/transport.h"

namespace tracer {

/// Feature sets. An instantiation is compiled for the features of its set; the scene's requirements select among these
/// at run time. Images are bit-identical for every set that supports the scene.
struct AllFeatures {
  static constexpr bool includes(bool Requirements::* /*feature*/) { return true; }
};

/// All features of local illumination models.
struct LocalFeatures {
  static constexpr bool includes(bool Requirements::*feature) {
    return feature != &Requirements::global_light && feature != &Requirements::emitters;
  }
};

/// Features of Whitted 1980: mirrors, glass, hard shadows and local shading models on untextured surfaces.
struct WhittedFeatures {
  static constexpr bool includes(bool Requirements::*feature) {
    using R = Requirements;
    for (bool R::*included : {&R::reflection, &R::refraction, &R::fresnel, &R::shadows, &R::transmissive_shadows,
                              &R::smooth_normals, &R::triangles, &R::spheres, &R::quadrics, &R::planes})
      if (feature == included) return true;
    return false;
  }
};

/// True if the set includes every required feature.
template <class Features>
bool supports(const Requirements& needs) {
  return std::all_of(std::begin(requirement_names), std::end(requirement_names), [&](const RequirementName& name) {
    return !(needs.*name.needed) || Features::includes(name.needed);
  });
}

/// The hits from `first` on.
inline HitSpan hits_from(const HitSpan& hits, std::size_t first) {
  return {hits.primitive + first, hits.t + first, hits.u + first, hits.v + first};
}

/// Calls trace(part, first) for parts of the rays from `first` on, until the render is cancelled; the results of the
/// rest are then unspecified. Between two tests there are so few rays that a limit of time also holds where each takes
/// milliseconds.
template <class Trace>
void for_each_part(const RaySpan& rays, const RenderControl& control, const Trace& trace) {
  constexpr std::size_t part_rays = 256;
  const auto from = [](const auto* values, std::size_t first) { return values == nullptr ? values : values + first; };
  for (std::size_t first = 0; first < rays.count && !control.cancelled(); first += part_rays)
    trace(RaySpan{rays.ox + first, rays.oy + first, rays.oz + first, rays.dx + first, rays.dy + first, rays.dz + first,
                  from(rays.t_max, first), from(rays.from, first), std::min(part_rays, rays.count - first)},
          first);
}

/// A place on a patch at which a path ends, and the share of the light there that it brings to its sample.
struct PathTermination {
  std::uint32_t sample = 0;
  TransportEntry entry;
};

/// The end of rays at a bounce: by the limits of the document, and by Russian roulette.
struct Termination {
  Termination(const Accuracy& accuracy, const Batch::Lifted& lifted, std::uint32_t bounces)
      : depth(bounces),
        all(accuracy.max_depth && depth > *accuracy.max_depth && !lifted.depth),
        cutoff(accuracy.cutoff && !lifted.cutoff ? *accuracy.cutoff : 0) {
    const bool deep = accuracy.max_depth && depth > *accuracy.max_depth && !all;
    if (deep || lifted.cutoff) kept = lifted.throughput;
    if (!all) roulette = deep || !accuracy.cutoff ? kept : lifted.cutoff ? std::min(kept, *accuracy.cutoff) : 0;
    late = (deep || !accuracy.max_depth) && depth >= std::max(accuracy.roulette_depth(), lifted.depth_min);
    if (late) growth = 1 / (1 - 2.0 / depth);
    if (!late && depth >= trapped_depth) trapped_growth = 1 / (1 - 2.0 / depth);
    most = late ? std::numeric_limits<double>::infinity() : std::nextafter(std::max(cutoff, roulette), 0.0);
  }
  Termination() = default;

  /// Hash of a path for random choices. That of the bounces alone has 32 bits and so repeats itself after some 2^16 of
  /// them: a path that ends by chance might never end.
  [[nodiscard]] std::uint32_t random_path(std::uint32_t path) const { return path + (depth >> 12); }

  std::uint32_t depth = 0;                                    ///< bounces of the rays
  bool all = false;                                           ///< no ray is traced
  double cutoff = 0;                                          ///< rays of smaller throughput are not traced
  double roulette = 0, kept = Accuracy::roulette_throughput;  ///< below the first a ray survives with the second
  /// Rays survive with the throughput of the ray before them, or of all at their hit times `growth`, if that is larger.
  bool late = false;
  double growth = 1;
  /// The same from this bounce on for rays that the interpolated normals of a mesh reflect totally, since they may
  /// never leave it: on a ball of 48 x 24 triangles 1 sample in 600.
  static constexpr std::uint32_t trapped_depth = 40;
  double trapped_growth = 1;
  double most = 0;  ///< rays of a larger throughput are traced; infinite ones end late, too
};

template <class Features>
struct WavefrontState {
  WavefrontState(const CompiledScene& compiled_scene, const RenderControl& render_control,
                 const Approximations& approximations_used)
      : scene(compiled_scene),
        control(render_control),
        approximations(approximations_used),
        requirements(scene.needs_of(approximations)),
        terms(scene.terms_of(approximations)),
        ambient(scene.ambient_of(approximations)),
        media(scene) {}

  /// True if the scene needs the feature; constant false if `Features` does not include it.
  template <bool Requirements::*feature>
  [[nodiscard]] bool needs() const {
    if constexpr (Features::includes(feature)) {
      return requirements.*feature;
    } else {
      return false;
    }
  }
  [[nodiscard]] Approximations approximate() const {
    if constexpr (Features::includes(&Requirements::approximations)) {
      return approximations;
    } else {
      return {};
    }
  }
  /// One test for every hit and light: false if each shadow ray must be traced.
  [[nodiscard]] bool may_cull_shadow_rays() const {
    if constexpr (Features::includes(&Requirements::approximations) || Features::includes(&Requirements::many_lights)) {
      return may_cull;
    } else {
      return false;
    }
  }
  [[nodiscard]] bool spawns_secondary_rays() const {
    return needs<&Requirements::reflection>() || needs<&Requirements::refraction>() ||
           approximate().reflections == Approximations::Reflections::environment;
  }
  [[nodiscard]] bool may_omit_radiance() const {
    return scene.accuracy.truncates() &&
           (spawns_secondary_rays() || needs<&Requirements::many_lights>() || needs<&Requirements::global_light>());
  }
  [[nodiscard]] bool writes_gbuffer() const {
    return needs<&Requirements::depth_cue>() || needs<&Requirements::layers>();
  }

  [[nodiscard]] WHITTLE_INLINE Color throughput_at_hit(const RayQueue& rays, std::size_t ray) const {
    const Color throughput = rays.throughput(ray);
    return needs<&Requirements::absorption>() ? throughput * media.transmittance(rays.media(ray), hits.t[ray])
                                              : throughput;
  }
  /// Patches at which paths end; null: they do not.
  [[nodiscard]] const PatchGrid* patches() const {
    const bool uses = scene.objects.radiosity != nullptr && needs<&Requirements::global_light>() &&
                      approximations.interreflection != Approximations::Interreflection::exact;
    return uses ? &scene.objects.radiosity->patches : nullptr;
  }
  /// True if paths continue from the first diffuse surface.
  [[nodiscard]] bool gathers() const {
    return terminations != nullptr || approximations.interreflection == Approximations::Interreflection::gather;
  }
  [[nodiscard]] const CompiledMaterial& material_of_lane(int lane) const { return terms[hit.material[lane]]; }

  const CompiledScene& scene;
  const RenderControl& control;
  const Approximations approximations;
  const Requirements& requirements;
  const std::vector<CompiledMaterial>& terms;
  const Color ambient;
  const bool may_cull = requirements.many_lights || approximations.shadows != Approximations::Shadows::exact;

  Batch batch;
  std::vector<Color> radiance;
  std::vector<float> omitted;
  Termination termination;                  ///< at the next bounce
  std::vector<SampleSignature> signatures;  ///< empty unless the batch wants them
  GBuffer gbuffer;
  RenderStatistics statistics;
  MediumStack media;
  std::vector<PathTermination>* terminations = nullptr;  ///< not null: where paths end, in place of the light there

  // The queue being shaded.
  Hits hits;                            ///< one per ray
  std::vector<std::uint32_t> hit_rays;  ///< rays that hit a surface

  HitPacket hit;                    ///< the packet being shaded
  PrincipledHit principled[lanes];  ///< by lane; undefined unless a material is principled
};

}  // namespace tracer
