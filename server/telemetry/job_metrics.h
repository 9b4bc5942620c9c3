#pragma once
/// Metrics of jobs: waiting and running times, ends, rays, cache use and target errors.

#include <functional>
#include <optional>

#include "server/queue/job_observer.h"
#include "server/telemetry/service_metrics.h"
#include "server/telemetry/throughput_estimate.h"

namespace telemetry {

class JobMetrics final : public queue::JobObserver {
 public:
  /// Reads the job from the store. If it throws, the job is not counted. Called from any thread.
  using FindJob = std::function<std::optional<queue::Job>(const std::string& id)>;

  /// Every call is passed on to `next`. All arguments must outlive this.
  JobMetrics(prometheus::Registry& registry, ThroughputEstimate& throughput, FindJob find, queue::JobObserver& next);

  void on_state_changed(const std::string& id, queue::JobState to) noexcept override;
  void on_waiters_notified(const std::string& id) noexcept override;
  void on_progress(const std::string& id, double fraction) noexcept override { next_.on_progress(id, fraction); }
  void on_removed(const std::string& id) noexcept override { next_.on_removed(id); }

 private:
  void create_series();
  void count_end(const queue::Job& job);

  Counters &submitted_, &ended_, &from_cache_, &rays_, &targets_, &geometry_, &textures_;
  Histograms &wait_seconds_, &run_seconds_, &error_ratio_;
  ThroughputEstimate& throughput_;
  const FindJob find_;
  queue::JobObserver& next_;
};

}  // namespace telemetry
