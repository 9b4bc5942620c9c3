#include "server/telemetry/metrics.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/jobs/job_store.h"
#include "server/telemetry/job_metrics.h"

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

class Nobody final : public jobs::Observer {
 public:
  void moved(const std::string&, jobs::JobState) noexcept override { ++told; }
  void progressed(const std::string&, double) noexcept override { ++told; }
  void removed(const std::string&) noexcept override { ++told; }
  int told = 0;
};

void expect_line(const std::string& text, const std::string& line) {
  EXPECT_NE(("\n" + text).find("\n" + line + "\n"), std::string::npos) << line << " in\n" << text;
}

TEST(JobMetrics, TellWaitsRunsRaysAndTargets) {
  Metrics metrics(telemetry::JobMetrics::families());
  Nobody next;
  jobs::Job job;
  job.state = jobs::JobState::succeeded;
  job.created_at = 1000;
  job.started_at = 3000;
  job.ended_at = 3500;
  job.report =
      R"({"rays":{"camera":7,"shadow":5,"reflection":3,"refraction":2},"error":{"target":1,"met":true},"geometry_reused":true})";
  telemetry::JobMetrics observed(
      metrics, [&](const std::string&) { return job; }, next);
  observed.moved("a", jobs::JobState::queued);
  observed.moved("a", jobs::JobState::succeeded);
  job.report = R"({"rays":{"camera":1},"error":{"target":2,"met":false}})";
  observed.moved("b", jobs::JobState::succeeded);
  job.report = R"({"rays":{"camera":1},"error":{"target":null,"met":true}})";
  observed.moved("c", jobs::JobState::succeeded);
  observed.progressed("a", 0.5);
  observed.removed("a");
  EXPECT_EQ(next.told, 6) << "everything is passed on";
  const std::string text = metrics.text();
  for (const char* line : {"whittle_jobs_submitted_total 1", "whittle_jobs_ended_total{state=\"succeeded\"} 3",
                           "whittle_job_wait_seconds_sum 6", "whittle_job_run_seconds_sum{state=\"succeeded\"} 1.5",
                           "whittle_rays_total{kind=\"camera\"} 9", "whittle_rays_total{kind=\"shadow\"} 5",
                           "whittle_rays_total{kind=\"refraction\"} 2", "whittle_error_targets_total{met=\"yes\"} 1",
                           "whittle_error_targets_total{met=\"no\"} 1", "whittle_geometry_total{reused=\"yes\"} 1",
                           "whittle_geometry_total{reused=\"no\"} 2"}) {
    expect_line(text, line);
  }
}

TEST(JobMetrics, AJobThatCannotBeLookedUpIsStillAnEnd) {
  Metrics metrics(telemetry::JobMetrics::families());
  Nobody next;
  telemetry::JobMetrics observed(
      metrics,
      [](const std::string&) -> std::optional<jobs::Job> {
        throw jobs::StoreFailure(jobs::StoreFailure::Kind::unavailable, "gone");
      },
      next);
  observed.moved("a", jobs::JobState::failed);
  expect_line(metrics.text(), "whittle_jobs_ended_total{state=\"failed\"} 1");
  EXPECT_EQ(next.told, 1);
}

}  // namespace
