#pragma once
/// The seam between samplers and integrators: a sampler fills a batch of samples, calls `trace()` and reads the
/// results.

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/sample_signature.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// First hits of the camera rays of a batch, for depth cue, alpha and layers. Parallel to the batch's samples. A
/// surface within a solid of higher priority is a hit, but has no normal, color or object.
struct GBuffer {
  static constexpr double no_hit = std::numeric_limits<double>::infinity();
  static constexpr std::uint32_t no_object = std::numeric_limits<std::uint32_t>::max();

  std::vector<double> depth;  ///< world space, along the viewing axis; `no_hit` for escaped rays
  std::vector<Vec3> normal;   ///< unit, towards the camera
  std::vector<Color> albedo;  ///< C of the material
  std::vector<std::uint32_t> object;

  void reset(std::size_t samples) {
    depth.assign(samples, no_hit);
    normal.assign(samples, Vec3{});
    albedo.assign(samples, Color{});
    object.assign(samples, no_object);
  }
  [[nodiscard]] bool hit(std::size_t sample) const { return depth[sample] != no_hit; }
};

/// Samples of the image that are traced together, one camera ray each. The vectors are parallel to `samples`.
struct Batch {
  /// Seeds of a sample's random choices.
  struct Sample {
    std::uint64_t key = 0;    ///< hash of the pixel
    std::uint32_t index = 0;  ///< index among the pixel's samples
  };
  std::vector<Sample> samples;
  std::vector<double> x, y;        ///< position in the full image, in pixels
  std::vector<Vec2> lens;          ///< position on the lens, in [0,1)^2; empty in scenes without a lens
  std::vector<double> share;       ///< fraction of the pixel's width; empty in scenes without filtered textures
  std::uint32_t light_points = 1;  ///< points per area light at hits of camera rays; later bounces use one
  bool sign = false;               ///< signatures are wanted
  /// Limits of the document that do not hold for these samples: rays that they would end are continued by chance, with
  /// at least this throughput, and for any reason only after `depth_min` bounces.
  struct Lifted {
    bool cutoff = false, depth = false;
    double throughput = Accuracy::roulette_throughput;
    std::uint32_t depth_min = 0;
  } lifted{};

  /// Empties the batch and keeps its memory.
  void clear() {
    samples.clear();
    x.clear();
    y.clear();
    lens.clear();
    share.clear();
    light_points = 1;
    sign = false;
    lifted = {};
  }
};

/// An integrator with the scratch memory of one thread. Results are valid until the next change of the batch.
class Tracer {
 public:
  virtual ~Tracer() = default;
  /// Samples to trace next. trace() does not change it.
  [[nodiscard]] virtual Batch& batch() = 0;
  /// Traces the batch. Returns false if cancelled; results are then undefined. Throws std::bad_alloc.
  virtual bool trace() = 0;
  /// Radiance of each sample; may be non-finite, which `statistics()` counts.
  [[nodiscard]] virtual const std::vector<Color>& radiance() const = 0;
  /// Throughput of the rays that limits of the document ended in each sample, and radiance of its culled shadow rays
  /// (sum of the maxima over RGB); empty if nothing can be left out.
  [[nodiscard]] virtual const std::vector<float>& omitted() const = 0;
  [[nodiscard]] virtual const std::vector<SampleSignature>& signatures() const = 0;
  /// First hits; filled if the scene needs a depth cue or layers.
  [[nodiscard]] virtual const GBuffer& gbuffer() const = 0;
  [[nodiscard]] virtual const RenderStatistics& statistics() const = 0;  ///< counts of all batches so far
};

/// Makes a tracer. `approximations`: the scene's, or none for exact samples.
template <class T>
using Make = std::function<std::unique_ptr<T>(const CompiledScene&, const RenderControl&, const Approximations&)>;
using MakeTracer = Make<Tracer>;

template <class T>
std::unique_ptr<T> make(const CompiledScene& scene, const RenderControl& control,
                        const Approximations& approximations) {
  return std::make_unique<T>(scene, control, approximations);
}

/// The Whitted integrator with the smallest set of features that supports the image and its exact samples.
std::unique_ptr<Tracer> make_wavefront(const CompiledScene& scene, const RenderControl& control,
                                       const Approximations& approximations);

inline void add(RenderStatistics& total, const RenderStatistics& part) {
  for (const auto& [name, count] : ray_kinds) total.rays.*count += part.rays.*count;
  total.samples += part.samples;
  total.holdout_samples += part.holdout_samples;
  total.non_finite += part.non_finite;
  total.culled_shadow_rays += part.culled_shadow_rays;
  total.culled_radiance += part.culled_radiance;
  total.cut_branches += part.cut_branches;
  total.truncated_branches += part.truncated_branches;
}

/// Pool of tracers with their scratch memory, one for each thread that needs one at the same time.
template <class T = Tracer>
class TracerPool {
 public:
  TracerPool(const Make<T>& make, const CompiledScene& scene, const RenderControl& control,
             const Approximations& approximations)
      : make_(make), scene_(scene), control_(control), approximations_(approximations) {}

  /// A tracer, which returns to the pool when the pointer ends.
  [[nodiscard]] auto lease() {
    const auto give_back = [this](T* tracer) {
      const std::lock_guard lock(mutex_);
      idle_.emplace_back(tracer);
    };
    const std::lock_guard lock(mutex_);
    std::unique_ptr<T> tracer = idle_.empty() ? make_(scene_, control_, approximations_) : std::move(idle_.back());
    if (!idle_.empty()) idle_.pop_back();
    return std::unique_ptr<T, decltype(give_back)>(tracer.release(), give_back);
  }

  [[nodiscard]] const Make<T>& make() const { return make_; }

  /// Sums over all tracers and add_statistics(). Precondition: no tracer is leased.
  [[nodiscard]] RenderStatistics statistics() const {
    RenderStatistics total = elsewhere_;
    for (const auto& idle : idle_) add(total, idle->statistics());
    return total;
  }

  /// Adds the counts of batches that tracers outside of the pool have traced.
  void add_statistics(const RenderStatistics& statistics) {
    const std::lock_guard lock(mutex_);
    add(elsewhere_, statistics);
  }

 private:
  const Make<T> make_;
  const CompiledScene& scene_;
  const RenderControl& control_;
  const Approximations approximations_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
  RenderStatistics elsewhere_;
};

}  // namespace tracer
