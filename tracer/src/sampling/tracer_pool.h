#pragma once
/// Tracers with their scratch memory, one for each thread that wants one at the same time.

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "tracer/src/integrators/whitted/wavefront.h"

namespace tracer {

inline void add(RenderStatistics& total, const RenderStatistics& part) {
  total.rays.camera += part.rays.camera;
  total.rays.shadow += part.rays.shadow;
  total.rays.reflection += part.rays.reflection;
  total.rays.refraction += part.rays.refraction;
  total.samples += part.samples;
  total.holdout_samples += part.holdout_samples;
  total.non_finite += part.non_finite;
  total.culled_shadow_rays += part.culled_shadow_rays;
  total.culled_radiance += part.culled_radiance;
  total.cut_branches += part.cut_branches;
  total.truncated_branches += part.truncated_branches;
}

template <class Model>
class WavefrontPool {
 public:
  WavefrontPool(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : scene_(scene), control_(control), approximations_(approximations) {}

  /// A tracer for as long as the lease lives.
  class Lease {
   public:
    explicit Lease(WavefrontPool& pool) : pool_(pool), wavefront_(pool.take()) {}
    ~Lease() { pool_.give_back(std::move(wavefront_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Wavefront<Model>& operator*() { return *wavefront_; }

   private:
    WavefrontPool& pool_;
    std::unique_ptr<Wavefront<Model>> wavefront_;
  };

  /// Of all tracers. None may be leased.
  [[nodiscard]] RenderStatistics statistics() const {
    RenderStatistics total;
    for (const auto& wavefront : idle_) add(total, wavefront->statistics());
    return total;
  }

 private:
  std::unique_ptr<Wavefront<Model>> take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<Wavefront<Model>>(scene_, control_, approximations_);
    std::unique_ptr<Wavefront<Model>> wavefront = std::move(idle_.back());
    idle_.pop_back();
    return wavefront;
  }
  void give_back(std::unique_ptr<Wavefront<Model>> wavefront) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(wavefront));
  }

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Approximations approximations_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Wavefront<Model>>> idle_;
};

}  // namespace tracer
