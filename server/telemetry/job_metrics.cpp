#include "server/telemetry/job_metrics.h"

#include <exception>

#include "api/report.h"

namespace telemetry {
namespace {

constexpr std::string_view submitted = "whittle_jobs_submitted_total", ends = "whittle_jobs_ended_total",
                           waited = "whittle_job_wait_seconds", ran = "whittle_job_run_seconds",
                           rays = "whittle_rays_total", cached = "whittle_jobs_from_cache_total",
                           targets = "whittle_error_targets_total", geometry = "whittle_geometry_total",
                           images = "whittle_texture_cache_total", error_ratio = "whittle_error_to_target_ratio";

double seconds(std::int64_t milliseconds) { return static_cast<double>(milliseconds) / 1000; }

}  // namespace

std::vector<Family> JobMetrics::families() {
  return {{submitted, "Jobs that came into the queue, those that came back to it among them."},
          {ends, "Jobs that ended, by state."},
          {waited, "From a job's creation to the start of its last attempt.", waiting_seconds()},
          {ran, "From the start of a job's last attempt to its end, by state.", waiting_seconds()},
          {cached, "Jobs that had their images from the result cache; they neither waited nor ran."},
          {rays, "Rays of jobs that succeeded, by kind."},
          {targets, "Jobs that succeeded and had asked for an error, by whether it was met."},
          {error_ratio,
           "Claimed error over the one asked for, of jobs that succeeded and had asked for one.",
           {0.125, 0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 1, 1.5, 2, 4, 8}},
          {geometry, "Jobs that succeeded, by whether an earlier job's geometry served them."},
          {images, "Files of textures in jobs that succeeded, by whether an earlier job had decoded them."}};
}

void JobMetrics::on_state_changed(const std::string& id, queue::JobState to) noexcept {
  try {
    if (to == queue::JobState::queued) metrics_.add(submitted, {});
    if (queue::ended(to)) metrics_.add(ends, {{"state", queue::name_of(to)}});
  } catch (const std::exception&) {
    // Memory is short: a figure is the least of what is missed then.
  }
  next_.on_state_changed(id, to);
}

void JobMetrics::on_waiters_notified(const std::string& id) noexcept {
  try {
    if (const auto job = find_(id)) count_end(*job);
  } catch (const std::exception&) {
    // So here, or the store is away.
  }
  next_.on_waiters_notified(id);
}

void JobMetrics::count_end(const queue::Job& job) {
  if (!job.started_at || !job.ended_at) return;  // cancelled while it waited
  if (job.state == queue::JobState::succeeded && job.attempt == 0) return metrics_.add(cached, {});
  metrics_.observe(waited, {}, seconds(*job.started_at - job.created_at));
  metrics_.observe(ran, {{"state", queue::name_of(job.state)}}, seconds(*job.ended_at - *job.started_at));
  const auto figures = api::read_report(job.report);
  if (!figures) return;
  pace_.learn(*figures);
  metrics_.add(rays, {{"kind", "camera"}}, static_cast<double>(figures->rays.camera));
  metrics_.add(rays, {{"kind", "shadow"}}, static_cast<double>(figures->rays.shadow));
  metrics_.add(rays, {{"kind", "reflection"}}, static_cast<double>(figures->rays.reflection));
  metrics_.add(rays, {{"kind", "refraction"}}, static_cast<double>(figures->rays.refraction));
  metrics_.add(geometry, {{"reused", figures->cache_hits.geometry ? "yes" : "no"}});
  metrics_.add(images, {{"reused", "yes"}}, figures->cache_hits.textures);
  metrics_.add(images, {{"reused", "no"}}, figures->cache_hits.decoded_textures);
  if (figures->error_to_target) metrics_.observe(error_ratio, {}, *figures->error_to_target);
  if (figures->target_met) metrics_.add(targets, {{"met", *figures->target_met ? "yes" : "no"}});
}

}  // namespace telemetry
