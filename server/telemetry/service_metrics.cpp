#include "server/telemetry/service_metrics.h"

#include <prometheus/text_serializer.h>

#include <exception>
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

std::vector<MetricFamily> gauges(const GaugeValues& values) {
  std::vector<Series> jobs;
  for (const auto& [state, count] : values.jobs) jobs.push_back({{{"state", state}}, static_cast<double>(count)});
  std::vector<Series> nodes;
  for (const auto& [role, count] : values.nodes) nodes.push_back({{{"role", role}}, static_cast<double>(count)});
  std::vector<MetricFamily> families{
      gauge("whittle_build_info", "Version of the program; always 1.",
            std::vector<Series>{{{{"version", std::string(values.version)}, {"build", std::string(values.build)}}, 1}}),
      gauge("whittle_jobs", "Jobs in the store, by state; queued is the queue depth.", jobs),
      gauge("whittle_nodes", "Daemons that share the queue, by role.", nodes),
      gauge("whittle_queue_age_seconds", "Waiting time of the job that could run longest; 0 if none waits.",
            values.queue_age_s),
      gauge("whittle_disk_free_bytes", "Free space on the disk of the data directory.", values.disk_space.free_bytes),
      gauge("whittle_disk_reserve_bytes", "Free space below which new jobs and uploads are refused.",
            values.disk_space.reserve_bytes),
      gauge("whittle_upload_bytes", "Size of all uploaded files together.", values.upload_bytes),
      gauge("whittle_artifact_bytes", "Size of all images together.", values.artifact_bytes),
      gauge("whittle_artifact_limit_bytes", "Size above which the jobs that ended first lose their images.",
            values.artifact_bytes_max),
      gauge("whittle_connections", "Open connections of clients.", values.connections),
      gauge("whittle_event_listeners", "Event streams and long polls.", values.event_listeners),
      gauge("whittle_cache_bytes", "Memory that the worker keeps for later jobs, by kind.",
            std::vector<Series>{{{{"kind", "geometry"}}, static_cast<double>(values.cache_geometry_bytes)},
                                {{{"kind", "images"}}, static_cast<double>(values.cache_image_bytes)}})};
  if (values.rss_bytes) {
    families.push_back(
        gauge("process_resident_memory_bytes", "Memory of the daemon, without its worker.", *values.rss_bytes));
  }
  if (values.worker_rss_bytes) {
    families.push_back(
        gauge("whittle_worker_resident_memory_bytes", "Memory of the worker process.", *values.worker_rss_bytes));
  }
  return families;
}

/// Upper bounds of buckets for waiting and running times, from 10 ms to 4 hours.
const prometheus::Histogram::BucketBoundaries duration_buckets_s{0.01, 0.03, 0.1, 0.3, 1,    3,    10,
                                                                 30,   60,   300, 900, 3600, 14400};
const prometheus::Histogram::BucketBoundaries ratio_buckets{0.125, 0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 1, 1.5, 2, 4, 8};

double seconds(std::int64_t milliseconds) { return static_cast<double>(milliseconds) / 1000; }

prometheus::Labels yes_or_no(const std::string& name, bool value) { return {{name, value ? "yes" : "no"}}; }

Counters& add_counters(prometheus::Registry& registry, const std::string& name, const std::string& help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Histograms& add_histograms(prometheus::Registry& registry, const std::string& name, const std::string& help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

}  // namespace

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

JobMetrics::JobMetrics(prometheus::Registry& registry)
    : submitted_(add_counters(registry, "whittle_jobs_submitted_total", "Jobs queued, retries included.")),
      ended_(add_counters(registry, "whittle_jobs_ended_total", "Jobs ended, by state.")),
      from_cache_(add_counters(registry, "whittle_jobs_from_cache_total", "Jobs answered from the result cache.")),
      expired_(
          add_counters(registry, "whittle_jobs_expired_total", "Jobs that lost their document and images, by reason.")),
      rays_(add_counters(registry, "whittle_rays_total", "Rays of succeeded jobs, by kind.")),
      targets_(add_counters(registry, "whittle_error_targets_total",
                            "Succeeded jobs with a target error, by whether it was met.")),
      geometry_(add_counters(registry, "whittle_geometry_total", "Succeeded jobs, by whether geometry was reused.")),
      textures_(add_counters(registry, "whittle_texture_cache_total",
                             "Texture files of succeeded jobs, by whether the decoded image was reused.")),
      radiosity_(add_counters(registry, "whittle_radiosity_total",
                              "Succeeded jobs with radiosity, by whether its solution was reused.")),
      radiosity_work_(add_counters(registry, "whittle_radiosity_work_total",
                                   "Size of the computed solutions of radiosity, by kind.")),
      wait_seconds_(
          add_histograms(registry, "whittle_job_wait_seconds", "Creation of a job to the start of its last attempt.")),
      run_seconds_(add_histograms(registry, "whittle_job_run_seconds",
                                  "Start of a job's last attempt to the end of the job, by state.")),
      error_ratio_(add_histograms(registry, "whittle_error_to_target_ratio",
                                  "Estimated error divided by the target, of succeeded jobs with a target error.")) {
  create_series();
}

/// A series that is absent until its first event would hide that event from rate().
void JobMetrics::create_series() {
  submitted_.Add({});
  from_cache_.Add({});
  wait_seconds_.Add({}, duration_buckets_s);
  error_ratio_.Add({}, ratio_buckets);
  for (const char* state : {"succeeded", "failed", "cancelled"}) {
    ended_.Add({{"state", state}});
    run_seconds_.Add({{"state", state}}, duration_buckets_s);
  }
  for (const char* reason : {"expires_at", "age", "artifact_bytes"}) expired_.Add({{"reason", reason}});
  for (const auto& [kind, count] : tracer::ray_kinds) rays_.Add({{"kind", kind}});
  for (const char* kind : {"patches", "rays", "factors", "sweeps"}) radiosity_work_.Add({{"kind", kind}});
  for (const bool value : {false, true}) {
    targets_.Add(yes_or_no("met", value));
    geometry_.Add(yes_or_no("reused", value));
    textures_.Add(yes_or_no("reused", value));
    radiosity_.Add(yes_or_no("reused", value));
  }
}

void JobMetrics::on_state_changed(const std::string& /*id*/, queue::JobState to) noexcept {
  try {
    if (to == queue::JobState::queued) submitted_.Add({}).Increment();
    if (queue::ended(to)) ended_.Add({{"state", queue::name_of(to)}}).Increment();
    history_.add([&](ServiceHistory::Step& step, auto&) {
      step.ended += queue::ended(to);
      step.failed += to == queue::JobState::failed;
    });
  } catch (const std::exception&) {
    // Out of memory: the change is not counted.
  }
}

void JobMetrics::on_expired(const char* reason, int jobs) noexcept {
  try {
    expired_.Add({{"reason", reason}}).Increment(jobs);
  } catch (const std::exception&) {
    return;  // out of memory
  }
}

void JobMetrics::on_waiters_notified(const queue::EndedJob& job) noexcept {
  try {
    count_end(job);
  } catch (const std::exception&) {
    return;  // out of memory: the job is not counted
  }
}

void JobMetrics::count_end(const queue::EndedJob& job) {
  if (!job.run && job.state == queue::JobState::succeeded) from_cache_.Add({}).Increment();
  if (!job.run) return;
  const std::int64_t wait_ms = job.run->started_at - job.run->created_at;
  wait_seconds_.Add({}, duration_buckets_s).Observe(seconds(wait_ms));
  history_.add([&](auto&, auto& waits_ms) { waits_ms.push_back(wait_ms); });
  run_seconds_.Add({{"state", queue::name_of(job.state)}}, duration_buckets_s)
      .Observe(seconds(job.run->ended_at - job.run->started_at));
  const std::optional<api::ReportFigures>& figures = job.figures;
  if (!figures || !figures->of_render) return;
  for (const auto& [kind, count] : tracer::ray_kinds)
    rays_.Add({{"kind", kind}}).Increment(static_cast<double>(figures->rays.*count));
  const auto& rays = figures->rays;
  history_.add([&](ServiceHistory::Step& step, auto&) { step.rays += static_cast<std::int64_t>(rays.total()); });
  geometry_.Add(yes_or_no("reused", figures->cache_hits.geometry)).Increment();
  textures_.Add(yes_or_no("reused", true)).Increment(figures->cache_hits.textures);
  textures_.Add(yes_or_no("reused", false)).Increment(figures->cache_hits.decoded_textures);
  if (figures->radiosity) count_radiosity(*figures->radiosity, figures->cache_hits.radiosity);
  if (figures->error_to_target) error_ratio_.Add({}, ratio_buckets).Observe(*figures->error_to_target);
  if (figures->target_met) targets_.Add(yes_or_no("met", *figures->target_met)).Increment();
}

void JobMetrics::count_radiosity(const tracer::RadiosityFigures& figures, bool reused) {
  radiosity_.Add(yes_or_no("reused", reused)).Increment();
  if (reused) return;  // the work of an earlier job
  radiosity_work_.Add({{"kind", "patches"}}).Increment(figures.patches);
  radiosity_work_.Add({{"kind", "rays"}}).Increment(static_cast<double>(figures.rays));
  radiosity_work_.Add({{"kind", "factors"}}).Increment(static_cast<double>(figures.factors));
  radiosity_work_.Add({{"kind", "sweeps"}}).Increment(figures.sweeps);
}

}  // namespace telemetry
