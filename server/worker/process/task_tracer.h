#pragma once
/// Traces parts of images that other nodes render.

#include <chrono>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "server/worker/process/jobs.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/scene_cache.h"

namespace worker {

/// Keeps the compiled scenes of the latest documents. Thread-safe.
class TaskTracer {
 public:
  /// The arguments must outlive it.
  TaskTracer(const JobFiles& files, tracer::SceneCache& cache) : files_(files), cache_(cache) {}

  /// Traces on the oneTBB arena of the calling thread. Never throws.
  TaskTraced trace(const TraceTask& task) noexcept;
  /// Frees scenes that no task has used for some time.
  void drop_idle_scenes();

 private:
  using Clock = std::chrono::steady_clock;
  struct Scene {
    std::string document;
    std::mutex mutex;  ///< held while it is compiled
    std::shared_ptr<const tracer::CompiledScene> compiled;
    bool failed = false;
    Clock::time_point used_at;
    int users = 0;
  };
  static constexpr std::size_t scenes_max = 2;
  static constexpr std::chrono::seconds kept{10};

  std::shared_ptr<Scene> scene_of(const std::string& document);
  std::shared_ptr<const tracer::CompiledScene> compiled(Scene& scene);

  const JobFiles& files_;
  tracer::SceneCache& cache_;
  mutable std::mutex mutex_;
  std::list<std::shared_ptr<Scene>> scenes_;  ///< the latest first
};

}  // namespace worker
