#include "server/telemetry/job_metrics.h"

#include <exception>

#include "api/report.h"

namespace telemetry {
namespace {

const prometheus::Histogram::BucketBoundaries ratio_buckets{0.125, 0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 1, 1.5, 2, 4, 8};

double seconds(std::int64_t milliseconds) { return static_cast<double>(milliseconds) / 1000; }

prometheus::Labels yes_or_no(const std::string& name, bool value) { return {{name, value ? "yes" : "no"}}; }

}  // namespace

JobMetrics::JobMetrics(prometheus::Registry& registry, ThroughputEstimate& throughput, FindJob find,
                       queue::JobObserver& next)
    : submitted_(add_counters(registry, "whittle_jobs_submitted_total", "Jobs queued, retries included.")),
      ended_(add_counters(registry, "whittle_jobs_ended_total", "Jobs ended, by state.")),
      from_cache_(add_counters(registry, "whittle_jobs_from_cache_total", "Jobs answered from the result cache.")),
      rays_(add_counters(registry, "whittle_rays_total", "Rays of succeeded jobs, by kind.")),
      targets_(add_counters(registry, "whittle_error_targets_total",
                            "Succeeded jobs with a target error, by whether it was met.")),
      geometry_(add_counters(registry, "whittle_geometry_total", "Succeeded jobs, by whether geometry was reused.")),
      textures_(add_counters(registry, "whittle_texture_cache_total",
                             "Texture files of succeeded jobs, by whether the decoded image was reused.")),
      wait_seconds_(
          add_histograms(registry, "whittle_job_wait_seconds", "Creation of a job to the start of its last attempt.")),
      run_seconds_(add_histograms(registry, "whittle_job_run_seconds",
                                  "Start of a job's last attempt to the end of the job, by state.")),
      error_ratio_(add_histograms(registry, "whittle_error_to_target_ratio",
                                  "Estimated error divided by the target, of succeeded jobs with a target error.")),
      throughput_(throughput),
      find_(std::move(find)),
      next_(next) {
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
  for (const char* kind : {"camera", "shadow", "reflection", "refraction"}) rays_.Add({{"kind", kind}});
  for (const bool value : {false, true}) {
    targets_.Add(yes_or_no("met", value));
    geometry_.Add(yes_or_no("reused", value));
    textures_.Add(yes_or_no("reused", value));
  }
}

void JobMetrics::on_state_changed(const std::string& id, queue::JobState to) noexcept {
  try {
    if (to == queue::JobState::queued) submitted_.Add({}).Increment();
    if (queue::ended(to)) ended_.Add({{"state", queue::name_of(to)}}).Increment();
  } catch (const std::exception&) {
    // Out of memory: the change is not counted.
  }
  next_.on_state_changed(id, to);
}

void JobMetrics::on_waiters_notified(const std::string& id) noexcept {
  try {
    if (const auto job = find_(id)) count_end(*job);
  } catch (const std::exception&) {
    // Out of memory, or the store failed: the job is not counted.
  }
  next_.on_waiters_notified(id);
}

void JobMetrics::count_end(const queue::Job& job) {
  if (!job.started_at || !job.ended_at) return;  // cancelled before it ran
  if (job.state == queue::JobState::succeeded && job.attempt == 0) return from_cache_.Add({}).Increment();
  wait_seconds_.Add({}, duration_buckets_s).Observe(seconds(*job.started_at - job.created_at));
  run_seconds_.Add({{"state", queue::name_of(job.state)}}, duration_buckets_s)
      .Observe(seconds(*job.ended_at - *job.started_at));
  const auto figures = api::read_report(job.report);
  if (!figures) return;
  throughput_.add(*figures);
  rays_.Add({{"kind", "camera"}}).Increment(static_cast<double>(figures->rays.camera));
  rays_.Add({{"kind", "shadow"}}).Increment(static_cast<double>(figures->rays.shadow));
  rays_.Add({{"kind", "reflection"}}).Increment(static_cast<double>(figures->rays.reflection));
  rays_.Add({{"kind", "refraction"}}).Increment(static_cast<double>(figures->rays.refraction));
  geometry_.Add(yes_or_no("reused", figures->cache_hits.geometry)).Increment();
  textures_.Add(yes_or_no("reused", true)).Increment(figures->cache_hits.textures);
  textures_.Add(yes_or_no("reused", false)).Increment(figures->cache_hits.decoded_textures);
  if (figures->error_to_target) error_ratio_.Add({}, ratio_buckets).Observe(*figures->error_to_target);
  if (figures->target_met) targets_.Add(yes_or_no("met", *figures->target_met)).Increment();
}

}  // namespace telemetry
