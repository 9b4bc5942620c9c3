#include "server/telemetry/service_metrics.h"

#include <prometheus/text_serializer.h>
#include <unistd.h>

#include <exception>
#include <fstream>
#include <iterator>
#include <optional>

namespace telemetry {
namespace {

using prometheus::MetricFamily;

struct Series {
  std::vector<prometheus::ClientMetric::Label> labels;
  double value;
};

MetricFamily gauge(const std::string& name, const std::string& help, const std::vector<Series>& all_series) {
  MetricFamily family{name, help, prometheus::MetricType::Gauge, {}};
  for (const Series& series : all_series) {
    prometheus::ClientMetric& metric = family.metric.emplace_back();
    metric.label = series.labels;
    metric.gauge.value = series.value;
  }
  return family;
}

template <class Number>
MetricFamily gauge(const std::string& name, const std::string& help, Number value) {
  return gauge(name, help, std::vector<Series>{{{}, static_cast<double>(value)}});
}

/// Nothing if there is no such process.
std::optional<std::int64_t> resident_bytes(const std::string& process) {
  std::ifstream statm("/proc/" + process + "/statm");
  std::int64_t pages = 0, resident_pages = 0;
  if (!(statm >> pages >> resident_pages)) return std::nullopt;
  return resident_pages * ::sysconf(_SC_PAGESIZE);
}

MetricFamily job_counts(const GaugeValues& values) {
  std::vector<Series> series;
  for (const auto& [state, count] : values.jobs) series.push_back({{{"state", state}}, static_cast<double>(count)});
  return gauge("whittle_jobs", "Jobs in the store, by state; queued is the queue depth.", series);
}

MetricFamily cache_bytes(const GaugeValues& values) {
  return gauge("whittle_cache_bytes", "Memory that the worker keeps for later jobs, by kind.",
               std::vector<Series>{{{{"kind", "geometry"}}, static_cast<double>(values.cache_geometry_bytes)},
                                   {{{"kind", "images"}}, static_cast<double>(values.cache_image_bytes)}});
}

std::vector<MetricFamily> gauges(const GaugeValues& values) {
  std::vector<MetricFamily> families{
      gauge("whittle_build_info", "Version of the program; always 1.",
            std::vector<Series>{{{{"version", std::string(values.version)}, {"build", std::string(values.build)}}, 1}}),
      job_counts(values),
      gauge("whittle_queue_age_seconds", "Waiting time of the job that could run longest; 0 if none waits.",
            values.queue_age_s),
      gauge("whittle_disk_free_bytes", "Free space on the disk of the data directory.", values.disk_space.free_bytes),
      gauge("whittle_disk_reserve_bytes", "Free space below which new jobs and uploads are refused.",
            values.disk_space.reserve_bytes),
      gauge("whittle_upload_bytes", "Size of all uploaded files together.", values.upload_bytes),
      gauge("whittle_connections", "Open connections of clients.", values.connections),
      gauge("whittle_event_listeners", "Event streams and long polls.", values.event_listeners),
      cache_bytes(values)};
  if (const auto bytes = resident_bytes("self")) {
    families.push_back(gauge("process_resident_memory_bytes", "Memory of the daemon, without its worker.", *bytes));
  }
  if (const auto bytes = values.worker_pid > 0 ? resident_bytes(std::to_string(values.worker_pid)) : std::nullopt) {
    families.push_back(gauge("whittle_worker_resident_memory_bytes", "Memory of the worker process.", *bytes));
  }
  return families;
}

}  // namespace

const prometheus::Histogram::BucketBoundaries duration_buckets_s{0.01, 0.03, 0.1, 0.3, 1,    3,    10,
                                                                 30,   60,   300, 900, 3600, 14400};

Counters& add_counters(prometheus::Registry& registry, const std::string& name, const std::string& help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Histograms& add_histograms(prometheus::Registry& registry, const std::string& name, const std::string& help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

RequestMetrics::RequestMetrics(prometheus::Registry& registry)
    : requests_(add_counters(registry, "whittle_requests_total",
                             "Requests of clients, by method, route and status; without a route: refused or not "
                             "found.")),
      seconds_(add_histograms(registry, "whittle_request_seconds",
                              "Complete request to start of the reply, waits included, by route.")) {}

void RequestMetrics::count(std::string_view method, std::string_view route, int status, double seconds) noexcept {
  try {
    const std::string route_text(route);
    requests_.Add({{"method", std::string(method)}, {"route", route_text}, {"status", std::to_string(status)}})
        .Increment();
    seconds_.Add({{"route", route_text}}, duration_buckets_s).Observe(seconds);
  } catch (const std::exception&) {
    return;  // out of memory
  }
}

std::string metrics_text(const prometheus::Registry& registry, const GaugeValues& values) {
  std::vector<MetricFamily> families = gauges(values);
  std::vector<MetricFamily> registered = registry.Collect();
  families.insert(families.end(), std::make_move_iterator(registered.begin()),
                  std::make_move_iterator(registered.end()));
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace telemetry
