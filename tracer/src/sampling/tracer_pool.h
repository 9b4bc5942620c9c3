#pragma once
/// Pool of tracers with their scratch memory, one for each thread that needs one at the same time.

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "tracer/src/integrators/tracer_concept.h"

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

template <Tracer T>
class TracerPool {
 public:
  TracerPool(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : scene_(scene), control_(control), approximations_(approximations) {}

  /// Holds a tracer for its lifetime.
  class Lease {
   public:
    explicit Lease(TracerPool& pool) : pool_(pool), tracer_(pool.acquire()) {}
    ~Lease() { pool_.release(std::move(tracer_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    T& operator*() { return *tracer_; }

   private:
    TracerPool& pool_;
    std::unique_ptr<T> tracer_;
  };

  /// Sums over all tracers. Precondition: no tracer is leased.
  [[nodiscard]] RenderStatistics statistics() const {
    RenderStatistics total;
    for (const auto& idle : idle_) add(total, idle->statistics());
    return total;
  }

 private:
  std::unique_ptr<T> acquire() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<T>(scene_, control_, approximations_);
    std::unique_ptr<T> idle = std::move(idle_.back());
    idle_.pop_back();
    return idle;
  }
  void release(std::unique_ptr<T> idle) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(idle));
  }

  const CompiledScene& scene_;
  const RenderControl& control_;
  const Approximations approximations_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace tracer
