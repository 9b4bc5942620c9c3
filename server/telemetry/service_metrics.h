#pragma once
/// Metrics for Prometheus: counters and histograms in a registry, gauges that are read at each scrape, and the text of
/// both. server/README.md lists all names and labels.

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/report.h"
#include "server/queue/disk_health.h"
#include "server/queue/job_observer.h"

namespace telemetry {

using Counters = prometheus::Family<prometheus::Counter>;
using Histograms = prometheus::Family<prometheus::Histogram>;

/// Requests of clients.
class RequestMetrics {
 public:
  explicit RequestMetrics(prometheus::Registry& registry);
  /// `route` is the pattern of the route, so that there are few; empty: refused before routing, or not found. Any
  /// thread. A request is not counted if memory is short.
  void count(std::string_view method, std::string_view route, int status, double seconds) noexcept;

 private:
  Counters& requests_;
  Histograms& seconds_;
};

/// Values at the moment of a scrape.
struct GaugeValues {
  std::string_view version, build;                         ///< version and build of the program
  std::vector<std::pair<std::string, std::int64_t>> jobs;  ///< state and number
  double queue_age_s = 0;
  queue::DiskSpace disk_space;
  std::uint64_t upload_bytes = 0;
  std::size_t connections = 0, event_listeners = 0;
  std::uint64_t cache_geometry_bytes = 0, cache_image_bytes = 0;
  int worker_pid = 0;  ///< 0: no worker runs
};

/// Text format 0.0.4. Reads the resident memory of this process and of the worker from /proc.
std::string metrics_text(const prometheus::Registry& registry, const GaugeValues& gauges);

/// Recent render speed of this machine, for time estimates. Thread-safe.
class ThroughputEstimate {
 public:
  /// Adds a succeeded render. Ignored if the report has no estimated work.
  void add(const api::ReportFigures& figures) {
    if (!figures.seconds_per_work) return;
    const std::lock_guard lock(mutex_);
    seconds_per_work_.push_back(*figures.seconds_per_work);
    if (seconds_per_work_.size() > renders_max) seconds_per_work_.pop_front();
  }
  /// Median over the latest renders, per unit of api::estimated_work; nothing before the first one.
  [[nodiscard]] std::optional<double> seconds_per_work() const {
    std::unique_lock lock(mutex_);
    std::deque<double> sorted = seconds_per_work_;
    lock.unlock();
    if (sorted.empty()) return std::nullopt;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }

  static constexpr std::size_t renders_max = 63;  ///< recent enough to follow a change, enough for a stable median

 private:
  mutable std::mutex mutex_;
  std::deque<double> seconds_per_work_;  ///< oldest first
};

/// Metrics of jobs: waiting and running times, ends, rays, cache use and target errors.
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
