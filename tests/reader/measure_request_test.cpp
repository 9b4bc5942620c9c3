/// The body of POST /v1/measure.

#include <gtest/gtest.h>

#include "api/requests.h"
#include "tests/reader/reading.h"
#include "tracer/measure.h"

using namespace reader_tests;
using Lines = std::vector<std::string>;

namespace {

std::string request(const std::string& more, const std::string& scene = document_with()) {
  return R"({"scene": )" + scene + (more.empty() ? "" : ", " + more) + "}";
}

Lines issues(const std::string& text, const api::Limits& limits = {}) {
  const auto parsed = api::parse_measure(text, limits);
  if (parsed) return {};
  Lines lines;
  for (const tracer::Issue& issue : parsed.error().issues) lines.push_back(issue.pointer + " " + issue.code);
  return lines;
}

}  // namespace

TEST(MeasureRequest, VariesEveryParameterByDefault) {
  const auto parsed = api::parse_measure(request("", document_with(R"("name": "n", "job": {"priority": 7})")), {});
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->document.scene.name, "n");
  EXPECT_EQ(parsed->document.job.priority, 7);
  EXPECT_TRUE(parsed->parameters.empty());
  EXPECT_EQ(parsed->reference_samples, tracer::MeasureSettings().reference_samples);
}

TEST(MeasureRequest, ReadsParametersAndReferenceSamples) {
  const auto parsed =
      api::parse_measure(request(R"("settings": {"parameters": ["samples", "cutoff"], "reference_samples": 64})"), {});
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->parameters, (Lines{"samples", "cutoff"}));
  EXPECT_EQ(parsed->reference_samples, 64u);
}

TEST(MeasureRequest, ReportsAllIssuesWithTheirPointers) {
  EXPECT_EQ(issues(R"({"settings": {"parameters": ["samples", "speed", "samples", 3], "reference_samples": 15, "x": 1},
                       "scene": {"version": 1, "image": {"width": 0}}, "more": 1})"),
            (Lines{"/settings/parameters/1 unknown_value", "/settings/parameters/2 duplicate_value",
                   "/settings/parameters/3 wrong_type", "/settings/reference_samples out_of_range",
                   "/settings/x unknown_field", "/more unknown_field", "/scene/camera missing_field",
                   "/scene/image/width out_of_range"}));
}

TEST(MeasureRequest, RejectsWrongTypesAndMissingFields) {
  EXPECT_EQ(issues("[]"), Lines{" wrong_type"});
  EXPECT_EQ(issues("{}"), Lines{"/scene missing_field"});
  EXPECT_EQ(issues(R"({"scene": 3})"), Lines{"/scene wrong_type"});
  EXPECT_EQ(issues(request(R"("settings": [])")), Lines{"/settings wrong_type"});
  EXPECT_EQ(issues(request(R"("settings": {"parameters": []})")), Lines{"/settings/parameters wrong_length"});
  EXPECT_EQ(issues(request(R"("settings": {"parameters": "samples"})")), Lines{"/settings/parameters wrong_type"});
  EXPECT_EQ(issues(request(R"("settings": {"reference_samples": 1e9})")),
            Lines{"/settings/reference_samples out_of_range"});
  EXPECT_EQ(issues(request(R"("settings": {}, "settings": {})")), Lines{"/settings duplicate_key"});
  const auto not_json = api::parse_measure("{\n oops", {});
  ASSERT_FALSE(not_json);
  EXPECT_EQ(not_json.error().kind, api::Refusal::Kind::not_json);
  EXPECT_EQ(not_json.error().line, 2u);
}

TEST(MeasureRequest, AppliesTheSampleLimitToTheReference) {
  api::Limits limits;
  const std::string scene = document_with(R"("image": {"width": 10, "height": 10})");
  limits.scene.samples_times_pixels = 1600;
  EXPECT_EQ(issues(request(R"("settings": {"reference_samples": 16})", scene), limits), Lines{});
  EXPECT_EQ(issues(request(R"("settings": {"reference_samples": 17})", scene), limits),
            Lines{"/settings/reference_samples limit_exceeded"});
  EXPECT_EQ(issues(request("", scene), limits), Lines{"/settings/reference_samples limit_exceeded"})
      << "the limit also applies to the default";
}
