#include <gtest/gtest.h>

#include "api/report.h"
#include "server/resources/resource_json.h"

namespace {

queue::JobView running_view() {
  queue::JobView view;
  view.job.id = "0190a000-0000-7000-8000-000000000001";
  view.job.name = "spheres";
  view.job.state = queue::JobState::running;
  view.job.created_at = 1'700'000'000'123;
  view.job.started_at = 1'700'000'001'000;
  view.job.attempt = 1;
  view.job.width = 64;
  view.job.height = 48;
  view.progress = 0.25;
  return view;
}

void expect_part(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in\n" << text;
}

TEST(JobJson, HasTimesInRfc3339AndAnEtaExtrapolatedFromTheElapsedTime) {
  const std::string text = resources::write_job(running_view(), 1'700'000'003'000);
  expect_part(text,
              R"("created_at":"2023-11-14T22:13:20.123Z","started_at":"2023-11-14T22:13:21.000Z","ended_at":null)");
  expect_part(text, R"("state":"running","progress":0.25,"eta_s":6.0)");
}

TEST(JobJson, HasNoEtaBeforeAnyProgress) {
  queue::JobView view = running_view();
  view.progress = 0;
  expect_part(resources::write_job(view, 1'700'000'003'000), R"("eta_s":null)");
  view.progress = 0.5;
  view.job.state = queue::JobState::queued;
  expect_part(resources::write_job(view, 1'700'000'003'000), R"("eta_s":null)");
}

TEST(JobJson, LinksArtifactsAndEmbedsTheReportOfASucceededJob) {
  queue::JobView view = running_view();
  expect_part(resources::write_job(view, 0),
              R"("accuracy":null,"report":null,"measurement":null,"problem":null,"artifacts":[])");
  view.job.state = queue::JobState::succeeded;
  view.job.report = R"({"non_finite":0})";
  view.job.artifacts = {{"image.exr", "image/x-exr", std::string(64, 'a'), 12}};
  const std::string text = resources::write_job(view, 0);
  const std::string url = "/v1/jobs/" + view.job.id + "/image.exr";
  expect_part(text, R"("report":{"non_finite":0})");
  expect_part(text, R"("bytes":12,"sha256":")" + std::string(64, 'a') + R"(","url":")" + url + "\"");
  expect_part(text, R"("cancel":null,"retry":null,"events":"/v1/jobs/)" + view.job.id +
                        R"(/events","preview":"/v1/jobs/)" + view.job.id + R"(/preview","scene":"/v1/jobs/)" +
                        view.job.id + R"(/scene","image":")" + url + "\"");
}

TEST(JobJson, HasAMeasurementInsteadOfAReportForMeasureJobs) {
  queue::JobView view = running_view();
  expect_part(resources::write_job(view, 0), R"("kind":"render")");
  view.job.kind = queue::JobKind::measure;
  view.job.accuracy = R"({"target_error":2.0})";
  expect_part(resources::write_job(view, 0), R"("accuracy":{"target_error":2.0},"report":null,"measurement":null)");
  view.job.state = queue::JobState::succeeded;
  view.job.report = R"({"points":[]})";
  const std::string text = resources::write_job(view, 0);
  expect_part(text, R"("kind":"measure")");
  expect_part(text, R"("report":null,"measurement":{"points":[]})");
}

TEST(JobJson, LinksRetryOfAFailedJobUntilItExpires) {
  queue::JobView view = running_view();
  expect_part(resources::write_job(view, 0), R"("retry":null)");
  view.job.state = queue::JobState::failed;
  expect_part(resources::write_job(view, 0), R"("cancel":null,"retry":"/v1/jobs/)" + view.job.id + "/retry\"");
  view.job.expired = true;
  expect_part(resources::write_job(view, 0), R"("retry":null)");
}

TEST(BatchJson, DerivesStateAndProgressFromItsJobs) {
  using enum queue::JobState;
  queue::BatchState state;
  state.batch = {"0190a000-0000-7000-8000-0000000000b0", "", "orbit", "", 0, 2, 4};
  const std::vector<std::pair<std::map<queue::JobState, std::int64_t>, std::string>> table = {
      {{{queued, 4}}, R"("state":"queued","progress":0.0)"},
      {{{queued, 2}, {succeeded, 2}}, R"("state":"running","progress":0.5)"},
      {{{running, 1}, {failed, 3}}, R"("state":"running","progress":0.75)"},
      {{{succeeded, 3}, {failed, 1}}, R"("state":"failed","progress":1.0)"},
      {{{succeeded, 3}, {cancelled, 1}}, R"("state":"cancelled","progress":1.0)"},
      {{{succeeded, 4}}, R"("state":"succeeded","progress":1.0)"},
  };
  for (const auto& [jobs, part] : table) {
    state.jobs = jobs;
    expect_part(resources::write(state), part);
  }
  expect_part(resources::write(state), R"("max_failed":2)");
}

TEST(JobJson, ReplacesInvalidUtf8) {
  queue::JobView view = running_view();
  view.job.name = "a\xff";
  expect_part(resources::write_job(view, 0), "\"name\":\"a\xef\xbf\xbd\"");
}

TEST(ProblemJson, WritesPointersAsUriFragments) {
  const tracer::Issue issue{
      "/materials/r\xc3\xa9"
      "d ^/color",
      "out_of_range", "must be >= 0, got -1"};
  const std::string text = resources::write(resources::ProblemReply{"urn:x", "t", 422, "d", "r", {issue}});
  expect_part(text, R"("pointer":"#/materials/r%C3%A9d%20%5E/color","code":"out_of_range")");
}

TEST(ProblemJson, OmitsAnEmptyListOfErrors) {
  EXPECT_EQ(resources::write(resources::ProblemReply{"urn:x", "t", 404, "d", "r", {}}),
            R"({"type":"urn:x","title":"t","status":404,"detail":"d","request_id":"r"})"
            "\n");
}

TEST(WithFormat, AppendsToTheFormatsOfTheDocumentOrTheDefault) {
  using tracer::Format;
  EXPECT_EQ(api::with_format(R"({"version":1})", Format::exr), R"({"version":1,"output":{"formats":["png","exr"]}})");
  EXPECT_EQ(api::with_format(R"({"output":{"exposure":1}})", Format::exr),
            R"({"output":{"exposure":1,"formats":["png","exr"]}})");
  EXPECT_EQ(api::with_format(R"({"output":{"formats":["exr"]}})", Format::png),
            R"({"output":{"formats":["exr","png"]}})");
}

TEST(WithFormat, PreservesEveryNumberOfTheDocument) {
  const std::string numbers =
      "[0.1,1e-300,1.7976931348623157e+308,18446744073709551615,-0.0,5e-324,123456789.123456789]";
  EXPECT_EQ(api::with_format("{\"a\":" + numbers + "}", tracer::Format::exr),
            "{\"a\":[0.1,1e-300,1.7976931348623157e+308,18446744073709551615,-0.0,5e-324,123456789.12345679]," +
                std::string(R"("output":{"formats":["png","exr"]}})"));
}

}  // namespace
