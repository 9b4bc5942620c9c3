#pragma once
/// Metrics for Prometheus: counters and histograms in a registry, gauges that are read at each scrape, and the text of
/// both. server/README.md lists all names and labels.

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/report.h"
#include "server/queue/disk_health.h"
#include "server/queue/job_observer.h"
#include "server/telemetry/service_history.h"

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
  std::vector<std::pair<std::string, std::int64_t>> jobs;  ///< state and number: queued, running, ended ones
  double queue_age_s = 0;
  queue::DiskSpace disk_space;
  std::uint64_t upload_bytes = 0;
  std::int64_t artifact_bytes = 0, artifact_bytes_max = 0;
  std::size_t connections = 0, event_listeners = 0;
  std::uint64_t cache_geometry_bytes = 0, cache_image_bytes = 0;
  std::optional<std::int64_t> rss_bytes, worker_rss_bytes;  ///< resident memory of the daemon and of its worker
  std::vector<std::pair<std::string, std::int64_t>> nodes;  ///< role and number of those that were seen lately
  int worker_pid = 0;                                       ///< 0: no worker runs
  int worker_jobs = 0, worker_slots = 0;                    ///< jobs that it runs, and may run at once
};

/// Text format 0.0.4.
std::string metrics_text(const prometheus::Registry& registry, const GaugeValues& gauges);

/// Metrics of jobs: waiting and running times, ends, rays, cache use and target errors.
class JobMetrics final : public queue::JobObserver {
 public:
  explicit JobMetrics(prometheus::Registry& registry);  ///< `registry` must outlive this

  void on_state_changed(const std::string& id, queue::JobState to) noexcept override;
  void on_waiters_notified(const queue::EndedJob& job) noexcept override;
  void on_expired(const char* reason, int jobs) noexcept override;
  ServiceHistory& history() { return history_; }

 private:
  void create_series();
  void count_end(const queue::EndedJob& job);
  void count_radiosity(const tracer::RadiosityFigures& figures, bool reused);

  Counters &submitted_, &ended_, &from_cache_, &expired_, &rays_, &targets_, &geometry_, &textures_, &radiosity_,
      &radiosity_work_;
  Histograms &wait_seconds_, &run_seconds_, &error_ratio_;
  ServiceHistory history_;
};

}  // namespace telemetry
