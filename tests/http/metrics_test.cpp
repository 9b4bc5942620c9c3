#include <gtest/gtest.h>

#include "api/report.h"
#include "server/queue/job_store.h"
#include "server/telemetry/service_metrics.h"

namespace {

void expect_line(const std::string& text, const std::string& line) {
  EXPECT_NE(("\n" + text).find("\n" + line + "\n"), std::string::npos) << line << " in\n" << text;
}

std::string text_of(const prometheus::Registry& registry) { return telemetry::metrics_text(registry, {}); }

TEST(MetricsText, HasHelpTypeAndValueOfEachGauge) {
  telemetry::GaugeValues values;
  values.version = "1.2";
  values.build = "quote\" backslash\\ newline\n";
  values.jobs = {{"queued", 3}, {"running", 1}};
  values.queue_age_s = 0.25;
  values.disk_space.free_bytes = 123'456'789'012;
  values.cache_geometry_bytes = 5;
  values.rss_bytes = 7;
  const std::string text = telemetry::metrics_text(prometheus::Registry(), values);
  const char* const help =
      "# HELP whittle_queue_age_seconds Waiting time of the job that could run longest; 0 if none waits.";
  for (const char* line : {R"(whittle_build_info{version="1.2",build="quote\" backslash\\ newline\n"} 1)", help,
                           "# TYPE whittle_queue_age_seconds gauge", "whittle_queue_age_seconds 0.25",
                           "whittle_jobs{state=\"queued\"} 3", "whittle_jobs{state=\"running\"} 1",
                           "whittle_disk_free_bytes 123456789012", "whittle_cache_bytes{kind=\"geometry\"} 5",
                           "whittle_cache_bytes{kind=\"images\"} 0", "process_resident_memory_bytes 7"}) {
    expect_line(text, line);
  }
  EXPECT_EQ(text.find("whittle_worker_resident_memory_bytes"), std::string::npos) << "there is no worker";
}

TEST(RequestMetrics, CountsByMethodRouteAndStatus) {
  prometheus::Registry registry;
  telemetry::RequestMetrics metrics(registry);
  for (const double seconds : {0.005, 0.01, 0.02, 20'000.0}) metrics.count("GET", "/v1/jobs", 200, seconds);
  metrics.count("POST", "", 404, 0.5);
  const std::string text = text_of(registry);
  for (const char* line : {"# TYPE whittle_requests_total counter", "# TYPE whittle_request_seconds histogram",
                           R"(whittle_requests_total{method="GET",route="/v1/jobs",status="200"} 4)",
                           R"(whittle_requests_total{method="POST",route="",status="404"} 1)",
                           R"(whittle_request_seconds_bucket{route="/v1/jobs",le="0.01"} 2)",
                           R"(whittle_request_seconds_bucket{route="/v1/jobs",le="0.03"} 3)",
                           R"(whittle_request_seconds_bucket{route="/v1/jobs",le="14400"} 3)",
                           R"(whittle_request_seconds_bucket{route="/v1/jobs",le="+Inf"} 4)",
                           R"(whittle_request_seconds_sum{route="/v1/jobs"} 20000.035)",
                           R"(whittle_request_seconds_count{route="/v1/jobs"} 4)"}) {
    expect_line(text, line);
  }
}

TEST(JobMetrics, CountsWaitsRunsRaysAndTargets) {
  prometheus::Registry registry;
  std::optional<queue::EndedJob::Run> run = {{.created_at = 1000, .started_at = 3000, .ended_at = 3500}};
  std::string_view report =
      R"({"rays":{"camera":7,"shadow":5,"reflection":3,"refraction":2,"diffuse":4},"error":{"target":0.5,"estimate":0.375,"met":true},
                   "geometry_reused":true,"textures":{"reused":3,"decoded":2},
                   "radiosity":{"patches":40,"limited":false,"rays":900,"factors":70,"sweeps":6,"reused":false,"bound":0},"estimated_work":1000,
                   "time_ms":{"queue":7,"parse":7,"build":100,"trace":1500,"encode":400}})";
  telemetry::JobMetrics observed(registry);
  const auto succeeded = [&](const std::string& id) {
    observed.on_state_changed(id, queue::JobState::succeeded);
    observed.on_waiters_notified({id, queue::JobState::succeeded, run, api::read_report(report)});
  };
  observed.on_state_changed("a", queue::JobState::queued);
  succeeded("a");
  report = R"({"rays":{"camera":1},"error":{"target":2,"estimate":6,"met":false},
               "radiosity":{"patches":40,"rays":900,"factors":70,"sweeps":6,"reused":true}})";
  succeeded("b");
  report = R"({"rays":{"camera":1},"error":{"target":null,"met":true}})";
  succeeded("c");
  run.reset();  // from the cache: neither its wait nor its rays are counted again
  succeeded("d");
  observed.history().close_step(0, 0, 0, 0);
  const telemetry::ServiceHistory::Step step = observed.history().hour().steps.front();
  EXPECT_EQ((std::pair{step.ended, step.rays}), (std::pair<std::int64_t, std::int64_t>{4, 23}));
  EXPECT_EQ(step.wait_p50_ms, 2000);
  observed.on_progress("a", 0.5);
  observed.on_removed({.id = "a"});
  observed.on_expired("age", 3);
  const std::string text = text_of(registry);
  for (const char* line : {"whittle_jobs_submitted_total 1",
                           "whittle_jobs_ended_total{state=\"succeeded\"} 4",
                           "whittle_jobs_ended_total{state=\"failed\"} 0",
                           "whittle_jobs_from_cache_total 1",
                           "whittle_jobs_expired_total{reason=\"age\"} 3",
                           "whittle_jobs_expired_total{reason=\"artifact_bytes\"} 0",
                           "whittle_job_wait_seconds_sum 6",
                           "whittle_job_run_seconds_sum{state=\"succeeded\"} 1.5",
                           "whittle_rays_total{kind=\"camera\"} 9",
                           "whittle_rays_total{kind=\"shadow\"} 5",
                           "whittle_rays_total{kind=\"refraction\"} 2",
                           "whittle_rays_total{kind=\"diffuse\"} 4",
                           "whittle_error_targets_total{met=\"yes\"} 1",
                           "whittle_error_targets_total{met=\"no\"} 1",
                           "whittle_geometry_total{reused=\"yes\"} 1",
                           "whittle_geometry_total{reused=\"no\"} 2",
                           "whittle_texture_cache_total{reused=\"yes\"} 3",
                           "whittle_texture_cache_total{reused=\"no\"} 2",
                           "whittle_radiosity_total{reused=\"yes\"} 1",
                           "whittle_radiosity_total{reused=\"no\"} 1",
                           "whittle_radiosity_work_total{kind=\"patches\"} 40",
                           "whittle_radiosity_work_total{kind=\"rays\"} 900",
                           "whittle_radiosity_work_total{kind=\"factors\"} 70",
                           "whittle_radiosity_work_total{kind=\"sweeps\"} 6",
                           "whittle_error_to_target_ratio_bucket{le=\"0.7\"} 0",
                           "whittle_error_to_target_ratio_bucket{le=\"0.8\"} 1",
                           "whittle_error_to_target_ratio_bucket{le=\"2\"} 1",
                           "whittle_error_to_target_ratio_bucket{le=\"4\"} 2",
                           "whittle_error_to_target_ratio_sum 3.75",
                           "whittle_error_to_target_ratio_count 2"}) {
    expect_line(text, line);
  }
}

TEST(ServiceHistory, SummarizesEachStepAndKeepsAnHour) {
  telemetry::ServiceHistory history;
  EXPECT_EQ(history.hour().until, 0);
  history.add([](telemetry::ServiceHistory::Step& step, std::vector<std::int64_t>& waits_ms) {
    for (std::int64_t wait = 100; wait >= 1; --wait) waits_ms.push_back(wait);
    step.ended = 3;
    step.failed = 1;
    step.rays = 12;
  });
  history.close_step(1000, 3, 2, 99);
  history.add([](auto&, auto& waits_ms) { waits_ms.push_back(11); });
  history.close_step(6000, 1, 1, 98);
  history.close_step(11'000, 0, 0, 97);
  const auto [steps, until] = history.hour();
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_EQ(until, 11'000);
  const telemetry::ServiceHistory::Step& first = steps[0];
  EXPECT_EQ((std::vector{first.queued, first.running, first.ended, first.failed, first.rays, first.rss_bytes}),
            (std::vector<std::int64_t>{3, 2, 3, 1, 12, 99}));
  EXPECT_EQ(first.wait_p50_ms, 50) << "of 1 .. 100";
  EXPECT_EQ(first.wait_p95_ms, 95);
  EXPECT_EQ(steps[1].wait_p95_ms, 11);
  EXPECT_EQ(steps[1].ended, 0);
  EXPECT_EQ(steps[2].wait_p50_ms, std::nullopt);
  for (int i = 0; i < 720; ++i) history.close_step(i, i, 0, 0);
  EXPECT_EQ(history.hour().steps.size(), 720u);
  EXPECT_EQ(history.hour().steps.front().queued, 0);
  EXPECT_EQ(history.hour().steps.back().queued, 719);
}

TEST(JobMetrics, CountsAJobThatIsCancelledBeforeItRunsAsEndedOnly) {
  prometheus::Registry registry;
  telemetry::JobMetrics observed(registry);
  observed.on_state_changed("a", queue::JobState::cancelled);
  observed.on_waiters_notified({"a", queue::JobState::cancelled});
  const std::string text = text_of(registry);
  expect_line(text, "whittle_jobs_ended_total{state=\"cancelled\"} 1");
  expect_line(text, "whittle_job_wait_seconds_count 0");
  expect_line(text, "whittle_jobs_from_cache_total 0");
}

}  // namespace
