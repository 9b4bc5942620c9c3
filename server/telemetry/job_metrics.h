#pragma once
/// What jobs come to, as figures: how long they waited and ran, how they ended, which rays they took, whether the
/// errors asked for were met.

#include <functional>
#include <optional>

#include "server/queue/job_observer.h"
#include "server/telemetry/metric_registry.h"
#include "server/telemetry/throughput_estimate.h"

namespace telemetry {

class JobMetrics final : public queue::JobObserver {
 public:
  /// The job as it is stored; may throw: then this job is not counted. Called from any thread.
  using Find = std::function<std::optional<queue::Job>(const std::string& id)>;

  /// `next` is told everything as well. All must outlive this.
  JobMetrics(Metrics& metrics, ThroughputEstimate& pace, Find find, queue::JobObserver& next)
      : metrics_(metrics), pace_(pace), find_(std::move(find)), next_(next) {}

  void on_state_changed(const std::string& id, queue::JobState to) noexcept override;
  void on_waiters_notified(const std::string& id) noexcept override;
  void on_progress(const std::string& id, double fraction) noexcept override { next_.on_progress(id, fraction); }
  void on_removed(const std::string& id) noexcept override { next_.on_removed(id); }

  /// Those that this adds to.
  static std::vector<Family> families();

 private:
  void count_end(const queue::Job& job);

  Metrics& metrics_;
  ThroughputEstimate& pace_;
  const Find find_;
  queue::JobObserver& next_;
};

}  // namespace telemetry
