#pragma once
/// Metrics for Prometheus: counters and histograms in a registry, gauges that are read at each scrape, and the text of
/// both. server/README.md lists all names and labels.

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/queue/disk_health.h"

namespace telemetry {

using Counters = prometheus::Family<prometheus::Counter>;
using Histograms = prometheus::Family<prometheus::Histogram>;

Counters& add_counters(prometheus::Registry& registry, const std::string& name, const std::string& help);
Histograms& add_histograms(prometheus::Registry& registry, const std::string& name, const std::string& help);

/// Upper bounds of buckets for waiting and running times, from 10 ms to 4 hours.
extern const prometheus::Histogram::BucketBoundaries duration_buckets_s;

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

}  // namespace telemetry
