#include <gtest/gtest.h>

#include <limits>

#include "server/queue/job_store.h"
#include "server/telemetry/job_metrics.h"
#include "server/telemetry/metric_registry.h"

namespace {

using telemetry::Metrics;

TEST(Metrics, CountersAddUpByLabels) {
  Metrics metrics(std::vector<telemetry::Family>{{"jobs_total", "Jobs."}});
  metrics.add("jobs_total", {{"state", "failed"}});
  metrics.add("jobs_total", {{"state", "failed"}}, 2);
  metrics.add("jobs_total", {{"state", "cancelled"}}, 0.5);
  EXPECT_EQ(metrics.text(),
            "# HELP jobs_total Jobs.\n# TYPE jobs_total counter\n"
            "jobs_total{state=\"cancelled\"} 0.5\njobs_total{state=\"failed\"} 3\n");
}

TEST(Metrics, HistogramsCountEachBucketWithAllBelowIt) {
  Metrics metrics(std::vector<telemetry::Family>{{"wait_seconds", "Wait.", {0.1, 1}}});
  for (const double seconds : {0.05, 0.1, 0.2, 5.0}) metrics.observe("wait_seconds", {}, seconds);
  EXPECT_EQ(metrics.text(),
            "# HELP wait_seconds Wait.\n# TYPE wait_seconds histogram\n"
            "wait_seconds_bucket{le=\"0.1\"} 2\nwait_seconds_bucket{le=\"1\"} 3\nwait_seconds_bucket{le=\"+Inf\"} 4\n"
            "wait_seconds_sum 5.35\nwait_seconds_count 4\n");
}

TEST(Metrics, LabelsAreEscaped) {
  EXPECT_EQ(telemetry::metric_line("a", {{"b", "\"\\\n"}, {"c", "d"}}, 1e20), "a{b=\"\\\"\\\\\\n\",c=\"d\"} 1e+20\n");
  EXPECT_EQ(telemetry::metric_line("a", {}, std::numeric_limits<double>::infinity()), "a +Inf\n");
}

class Nobody final : public queue::JobObserver {
 public:
  void on_state_changed(const std::string&, queue::JobState) noexcept override { ++told; }
  void on_waiters_notified(const std::string&) noexcept override { ++told; }
  void on_progress(const std::string&, double) noexcept override { ++told; }
  void on_removed(const std::string&) noexcept override { ++told; }
  int told = 0;
};

void expect_line(const std::string& text, const std::string& line) {
  EXPECT_NE(("\n" + text).find("\n" + line + "\n"), std::string::npos) << line << " in\n" << text;
}

TEST(JobMetrics, TellWaitsRunsRaysAndTargets) {
  Metrics metrics(telemetry::JobMetrics::families());
  Nobody next;
  queue::Job job;
  job.state = queue::JobState::succeeded;
  job.created_at = 1000;
  job.started_at = 3000;
  job.ended_at = 3500;
  job.report =
      R"({"rays":{"camera":7,"shadow":5,"reflection":3,"refraction":2},"error":{"target":0.5,"estimate":0.375,"met":true},
                   "geometry_reused":true,"textures":{"reused":3,"decoded":2},"estimated_work":1000,
                   "time_ms":{"queue":7,"parse":7,"build":100,"trace":1500,"encode":400}})";
  telemetry::ThroughputEstimate pace;
  job.attempt = 1;
  telemetry::JobMetrics observed(
      metrics, pace, [&](const std::string&) { return job; }, next);
  const auto succeeded = [&](const std::string& id) {
    observed.on_state_changed(id, queue::JobState::succeeded);
    observed.on_waiters_notified(id);
  };
  observed.on_state_changed("a", queue::JobState::queued);
  succeeded("a");
  job.report = R"({"rays":{"camera":1},"error":{"target":2,"estimate":6,"met":false}})";
  succeeded("b");
  job.report = R"({"rays":{"camera":1},"error":{"target":null,"met":true}})";
  succeeded("c");
  job.attempt = 0;  // from the cache: neither its wait nor its rays are told again
  succeeded("d");
  observed.on_progress("a", 0.5);
  observed.on_removed("a");
  EXPECT_DOUBLE_EQ(pace.seconds_per_work().value_or(0), 2.0 / 1000) << "of those that tell it";
  EXPECT_EQ(next.told, 11) << "everything is passed on";
  const std::string text = metrics.text();
  for (const char* line : {"whittle_jobs_submitted_total 1",
                           "whittle_jobs_ended_total{state=\"succeeded\"} 4",
                           "whittle_jobs_from_cache_total 1",
                           "whittle_job_wait_seconds_sum 6",
                           "whittle_job_run_seconds_sum{state=\"succeeded\"} 1.5",
                           "whittle_rays_total{kind=\"camera\"} 9",
                           "whittle_rays_total{kind=\"shadow\"} 5",
                           "whittle_rays_total{kind=\"refraction\"} 2",
                           "whittle_error_targets_total{met=\"yes\"} 1",
                           "whittle_error_targets_total{met=\"no\"} 1",
                           "whittle_geometry_total{reused=\"yes\"} 1",
                           "whittle_geometry_total{reused=\"no\"} 2",
                           "whittle_texture_cache_total{reused=\"yes\"} 3",
                           "whittle_texture_cache_total{reused=\"no\"} 2",
                           "whittle_error_to_target_ratio_bucket{le=\"0.7\"} 0",
                           "whittle_error_to_target_ratio_bucket{le=\"0.8\"} 1",
                           "whittle_error_to_target_ratio_bucket{le=\"2\"} 1",
                           "whittle_error_to_target_ratio_bucket{le=\"4\"} 2",
                           "whittle_error_to_target_ratio_sum 3.75",
                           "whittle_error_to_target_ratio_count 2"}) {
    expect_line(text, line);
  }
}

TEST(ThroughputEstimate, IsTheMedianOfTheLatestRenders) {
  telemetry::ThroughputEstimate pace;
  const auto learn = [&](double trace_ms) {
    pace.learn(R"({"rays":{},"error":{},"estimated_work":1000,"time_ms":{"trace":)" + std::to_string(trace_ms) + "}}");
  };
  EXPECT_EQ(pace.seconds_per_work(), std::nullopt);
  for (const char* other : {"", "{}", "[1]", R"({"points":[]})", R"({"rays":{},"error":{},"estimated_work":null})"}) {
    pace.learn(other);
  }
  EXPECT_EQ(pace.seconds_per_work(), std::nullopt) << "none of them is of a render";
  for (const double ms : {1000.0, 3000.0, 900'000.0}) learn(ms);
  EXPECT_DOUBLE_EQ(*pace.seconds_per_work(), 3.0 / 1000);
  for (std::size_t i = 0; i < telemetry::ThroughputEstimate::renders_max; ++i) learn(7000);
  EXPECT_DOUBLE_EQ(*pace.seconds_per_work(), 7.0 / 1000) << "those before are forgotten";
}

TEST(JobMetrics, AJobThatCannotBeLookedUpIsStillAnEnd) {
  Metrics metrics(telemetry::JobMetrics::families());
  Nobody next;
  telemetry::ThroughputEstimate pace;
  telemetry::JobMetrics observed(
      metrics, pace,
      [](const std::string&) -> std::optional<queue::Job> {
        throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "gone");
      },
      next);
  observed.on_state_changed("a", queue::JobState::failed);
  observed.on_waiters_notified("a");
  expect_line(metrics.text(), "whittle_jobs_ended_total{state=\"failed\"} 1");
  EXPECT_EQ(next.told, 2);
}

}  // namespace
