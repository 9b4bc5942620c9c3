/// The body of POST /v1/measure, and the documents that the settings of a measurement stand for.

#include "api/measure_request.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "api/src/result_json.h"
#include "tests/reader/reading.h"
#include "tests/support/scenes.h"
#include "tracer/measure.h"
#include "tracer/src/measure/model_comparison.h"

using namespace reader_tests;
using Lines = std::vector<std::string>;

namespace {

std::string request(const std::string& more, const std::string& scene = document_with()) {
  return R"({"scene": )" + scene + (more.empty() ? "" : ", " + more) + "}";
}

Lines issues(const std::string& text, const api::Limits& limits = {}) {
  const auto parsed = api::parse_measure(text, limits);
  return parsed ? Lines{} : issue_lines(parsed.error().issues);
}

/// Members of the accuracy section as JSON.
using Members = std::map<std::string, std::string>;

std::string text_of(const Members& members) {
  std::string text;
  for (const auto& [name, value] : members) text += (text.empty() ? "\"" : ", \"") + name + "\": " + value;
  return "{" + text + "}";
}

/// The accuracy section of a document in which a person changes one setting to that of the measurement.
Members changed(Members members, const tracer::Setting& setting) {
  const bool is_target = setting.parameter == "target_error";
  members.erase("preset");
  members.erase("target_error");
  const auto samples = members.find("samples");
  const bool is_range = samples != members.end() && samples->second.find(',') != std::string::npos;
  if (is_target && !is_range) members.erase("samples");
  if (!is_target) members.erase("tile_error");
  if (!is_target) members.erase("time_budget_ms");
  if (!is_target) members["samples"] = std::to_string(tracer::baseline_samples);
  if (setting.parameter != "approximate") members[setting.parameter] = setting.value;
  return members;
}

std::vector<Members> accuracies() {
  std::vector<Members> all{{}};
  for (const Members& sampling : std::vector<Members>{{},
                                                      {{"preset", "\"fine\""}},
                                                      {{"samples", "9"}},
                                                      {{"samples", "[2, 64]"}, {"target_error", "3"}},
                                                      {{"samples", "4"}, {"target_error", "0.5"}},
                                                      {{"tile_error", "2"}},
                                                      {{"time_budget_ms", "1e5"}, {"target_error", "2"}}})
    for (const Members& rest :
         std::vector<Members>{{},
                              {{"max_depth", "7"}},
                              {{"cutoff", "0.004"}, {"seed", "5"}},
                              {{"cutoff", "0"}},
                              {{"model", "\"global\""}, {"max_depth", "16"}},
                              {{"approximate", R"({"shadows": "none", "lights": "nearest-2"})"}}}) {
      all.push_back(sampling);
      all.back().insert(rest.begin(), rest.end());
    }
  return all;
}

/// A room of mirrors with a ball, which is matte, or of glass that divides rays with a lamp beside it.
std::string room(const Members& accuracy, const std::string& mirror, bool has_lamp, const std::string& size) {
  const std::string ball =
      has_lamp ? R"({"color": 0, "transmission": 0.9, "ior": 1.5})" : R"({"color": [0.2, 0.5, 0.7]})";
  const std::string lamp = has_lamp ? R"(, {"type": "sphere", "center": [0, 1, -1], "radius": 0.2, "material":
    {"diffuse": 0, "emission": 3}})"
                                    : "";
  return R"({"version": 1, "image": )" + size + R"(, "camera": {"position": [0, 0, 0.9], "look_at": [0.3, 0.1, 0],
    "fov": 80}, "lights": [{"type": "point", "position": [0.2, 1, 0.3], "intensity": 0.5}], "objects": [
    {"type": "box", "center": [0, 0, 0], "size": [3, 4, 3], "material": {"color": 0.5, "diffuse": 0.02,
     "reflection": )" +
         mirror + R"(}}, {"type": "sphere", "center": [0.3, 0, -0.4], "radius": 0.3,
     "material": )" +
         ball + R"(}, {"type": "disc", "center": [0, -1, 0],
     "normal": [0, 1, 0], "radius": 0.6, "material": {"color": [0.7, 0.3, 0.2], "diffuse": 0.8}})" +
         lamp + R"(], "accuracy": )" + text_of(accuracy) + "}";
}

}  // namespace

TEST(MeasuredSettings, AreTheDocumentWithTheNamedSettingChanged) {
  for (const Members& members : accuracies())
    for (const char* size : {R"({"width": 12, "height": 9})", R"({"width": 8000, "height": 4000})"}) {
      const tracer::Scene scene = accepted(room(members, "0.9", true, size)).scene;
      std::size_t compared = 0;
      for (const tracer::Setting& setting : tracer::settings(scene)) {
        const std::string shown = text_of(members) + " with " + title(setting);
        const api::Json settings = api::accuracy_json(setting.accuracy);
        Members written;
        for (const auto& [name, value] : settings.items()) written[name] = value.dump();
        EXPECT_EQ(accepted(room(written, "0.9", true, size)).scene.accuracy, setting.accuracy) << shown;
        if (setting.parameter == "model" || setting.parameter == "document") continue;
        tracer::Accuracy expected = accepted(room(changed(members, setting), "0.9", true, size)).scene.accuracy;
        if (setting.parameter == "approximate") expected.approximate = setting.accuracy.approximate;
        EXPECT_EQ(expected, setting.accuracy) << shown << ": " << text_of(changed(members, setting));
        ++compared;
      }
      EXPECT_GE(compared, 20u);
    }
}

/// Renders the settings of measurements again, each as a document of its own.
TEST(MeasuredSettings, RenderTheSamePixels) {
  const Lines parameters{"target_error", "samples", "max_depth", "cutoff", "approximate"};
  std::size_t compared = 0;
  for (const auto& [mirror, members, has_lamp] :
       {std::tuple{"0.97", Members{}, false},
        {"0.9", Members{{"samples", "4"}, {"max_depth", "20"}}, false},
        {"0.3", Members{{"model", "\"global\""}, {"cutoff", "0.01"}}, true}}) {
    const std::string size = R"({"width": 12, "height": 9})";
    const tracer::Scene scene = accepted(room(members, mirror, has_lamp, size)).scene;
    const tracer::Assets assets;
    tracer::MeasurementRun run(
        scene, assets,
        {.parameters = parameters, .reference_samples = 64, .threads = 1, .seconds = [now = 0.0]() mutable {
           return now += 1;
         }});
    tracer::RenderControl control;
    const std::size_t count = tracer::settings(scene, parameters).size();
    while (run.measurement().points.size() < count) ASSERT_FALSE(run.step(control).has_value());
    const tracer::DisplayImage truth = to_display(run.reference(), scene.output);
    const double reference_error = standard_error(run.reference(), scene.output);
    for (const tracer::MeasuredPoint& point : run.measurement().points) {
      tracer::Scene again = accepted(room(changed(members, point.setting), mirror, has_lamp, size)).scene;
      if (point.setting.parameter == "approximate") again.accuracy.approximate = point.setting.accuracy.approximate;
      const tracer::Rendered rendered = scenes::render(again);
      const std::string shown = mirror + (" " + title(point.setting));
      EXPECT_EQ(rendered.statistics.samples, point.samples) << shown;
      EXPECT_EQ(rendered.statistics.rays.total(), point.rays.total()) << shown;
      EXPECT_EQ(rendered.error.estimate, point.claimed.estimate) << shown;
      const double error = distance(truth, reference_error, to_display(rendered.image, scene.output));
      EXPECT_EQ(std::max(error, reference_error), point.error) << shown << ": another image";
      EXPECT_EQ(is_upper_limit(point, "error"), error <= reference_error) << shown;
      ++compared;
    }
  }
  EXPECT_GE(compared, 60u);
}

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
