/// The accuracy section: its fields, and the settings that result from them together.

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "tests/reader/reading.h"
#include "tracer/requirements.h"

namespace {

using namespace reader_tests;
using tracer::Accuracy;
using tracer::Approximations;

Accuracy accuracy_of(const std::string& members) {
  return accepted(document_with("\"accuracy\": {" + members + "}")).scene.accuracy;
}

/// "target 2, budget -, samples 1..4096" for adaptive sampling, "exactly 4, target -" for exact samples.
std::string summary_of(const Accuracy& accuracy) {
  const auto text = [](const std::optional<double>& value) {
    if (!value) return std::string("-");
    std::string digits = std::to_string(*value);
    digits.resize(digits.find_last_not_of('0') + 1);
    return digits.ends_with('.') ? digits.substr(0, digits.size() - 1) : digits;
  };
  if (!accuracy.adaptive) return "exactly " + std::to_string(accuracy.samples) + ", target " + text(accuracy.target());
  const tracer::Adaptive& adaptive = *accuracy.adaptive;
  return "target " + text(adaptive.target_error) + ", budget " + text(adaptive.time_budget_ms) + ", samples " +
         std::to_string(adaptive.samples_min) + ".." + std::to_string(adaptive.samples_max);
}

TEST(AccuracyReader, ResolvesPresetsTargetsBudgetsAndSamples) {
  EXPECT_EQ(summary_of(accepted(document_with()).scene.accuracy), "target 1, budget -, samples 1..4096");
  const std::pair<const char*, const char*> rows[] = {
      // The standard target error is the default.
      {"", "target 1, budget -, samples 1..4096"},
      {R"("seed": 7, "max_depth": 3)", "target 1, budget -, samples 1..4096"},
      {R"("samples": [3, 50])", "target 1, budget -, samples 3..50"},
      {R"("preset": "draft")", "target 4, budget -, samples 1..4096"},
      {R"("preset": "standard")", "target 1, budget -, samples 1..4096"},
      {R"("preset": "fine")", "target 0.5, budget -, samples 1..4096"},
      {R"("preset": "reference")", "target 0.25, budget -, samples 1..4096"},
      // A target error is preferred to a preset.
      {R"("target_error": 2.5)", "target 2.5, budget -, samples 1..4096"},
      {R"("preset": "draft", "target_error": 2.5)", "target 2.5, budget -, samples 1..4096"},
      {R"("target_error": 255)", "target 255, budget -, samples 1..4096"},
      // A time budget and a target of the worst tile have no default target beside them.
      {R"("time_budget_ms": 500)", "target -, budget 500, samples 1..4096"},
      {R"("time_budget_ms": 500, "target_error": 2)", "target 2, budget 500, samples 1..4096"},
      {R"("time_budget_ms": 500, "preset": "fine")", "target 0.5, budget 500, samples 1..4096"},
      {R"("tile_error": 3.5)", "target -, budget -, samples 1..4096"},
      {R"("tile_error": 3.5, "target_error": 2)", "target 2, budget -, samples 1..4096"},
      {R"("tile_error": 3.5, "preset": "fine")", "target 0.5, budget -, samples 1..4096"},
      // The target of exact samples is kept for the report.
      {R"("samples": [9, 9])", "exactly 9, target -"},
      {R"("samples": [9, 9], "target_error": 2)", "exactly 9, target 2"},
      {R"("samples": [9, 9], "preset": "fine")", "exactly 9, target 0.5"},
      {R"("samples": [9, 9], "time_budget_ms": 5)", "exactly 9, target -"},
  };
  for (const auto& [members, summary] : rows) EXPECT_EQ(summary_of(accuracy_of(members)), summary) << members;
}

TEST(AccuracyReader, KeepsTheTargetOfTheWorstTile) {
  EXPECT_EQ(accuracy_of("").tile_target(), std::nullopt);
  EXPECT_EQ(accuracy_of(R"("tile_error": 3.5)").tile_target(), 3.5);
  EXPECT_EQ(accuracy_of(R"("tile_error": 3.5, "samples": [9, 9])").tile_target(), 3.5);
}

TEST(AccuracyReader, ReadsEveryFieldOfAdaptiveSampling) {
  const Accuracy accuracy =
      accepted(file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field_of_images.json")).scene.accuracy;
  EXPECT_EQ(summary_of(accuracy), "target 2.5, budget 1500.5, samples 3..300");
  EXPECT_EQ(accuracy.model, Accuracy::Model::global);
  EXPECT_EQ(accuracy.tile_target(), 7.5);
  EXPECT_TRUE(accuracy.proof);
  EXPECT_EQ(accuracy.approximate, (Approximations{.shadows = Approximations::Shadows::map,
                                                  .reflections = Approximations::Reflections::environment,
                                                  .shading = Approximations::Shading::flat,
                                                  .interreflection = Approximations::Interreflection::ambient,
                                                  .nearest_lights = 7,
                                                  .mirror_roughness = 0.25}));
}

TEST(AccuracyReader, DefaultsToTheWhittedModelWithoutProofAndApproximations) {
  const Accuracy accuracy = accuracy_of(R"("approximate": {})");
  EXPECT_EQ(accuracy.model, Accuracy::Model::whitted);
  EXPECT_FALSE(accuracy.proof);
  EXPECT_EQ(accuracy.approximate, Approximations{});
}

TEST(AccuracyReader, ReadsNumbersOfNearestLightsUpToTheirLimit) {
  for (const std::uint32_t count : {1u, 1'000'000u})
    EXPECT_EQ(accuracy_of(R"("approximate": {"lights": "nearest-)" + std::to_string(count) + "\"}").approximate,
              Approximations{.nearest_lights = count});
}

TEST(AccuracyReader, ReducesMaximumSamplesOfLargeImages) {
  const auto samples = [](const std::string& accuracy) {
    const auto scene =
        accepted(document_with(R"("image": {"width": 8192, "height": 8192}, "accuracy": {)" + accuracy + "}")).scene;
    return summary_of(scene.accuracy);
  };
  // 2^34 samples over 2^26 pixels are 256 each.
  EXPECT_EQ(samples(""), "target 1, budget -, samples 1..256");
  EXPECT_EQ(samples(R"("samples": [2, 1000000])"), "target 1, budget -, samples 2..256");
  EXPECT_EQ(samples(R"("samples": [255, 256])"), "target 1, budget -, samples 255..256");
  EXPECT_EQ(outcome(document_with(R"("image": {"width": 8192, "height": 8192}, "accuracy": {"samples": [257, 300]})")),
            std::vector<std::string>{"/accuracy/samples limit_exceeded"});
}

TEST(AccuracyReader, IgnoresTheServicesSampleLimit) {
  api::Limits limits;
  limits.scene.samples_times_pixels = 640 * 480;
  const auto document = api::parse_scene(document_with(), limits);
  ASSERT_TRUE(document);
  EXPECT_EQ(summary_of(document->scene.accuracy), "target 1, budget -, samples 1..4096");
  limits.scene.samples_times_pixels -= 1;
  EXPECT_FALSE(api::parse_scene(document_with(), limits));
}

TEST(AccuracyReader, EndsRaysByChanceUnlessACutoffOrADepthIsNamed) {
  for (const char* members : {"", R"("samples": [4, 4])", R"("samples": [1, 4])", R"("time_budget_ms": 100)",
                              R"("target_error": 0.5)", R"("target_error": 0.5, "samples": [4, 4])"})
    EXPECT_FALSE(accuracy_of(members).truncates()) << members;
  for (const char* kind : {"", R"("samples": [4, 4], )"}) {
    const std::string sampling = kind;
    EXPECT_EQ(accuracy_of(sampling + R"("cutoff": 0.25)").cutoff, 0.25);
    EXPECT_EQ(accuracy_of(sampling + R"("cutoff": 0)").cutoff, 0.0);
    EXPECT_EQ(accuracy_of(sampling + R"("cutoff": 0.25)").max_depth, std::nullopt);
    EXPECT_EQ(accuracy_of(sampling + R"("max_depth": 0)").max_depth, 0u);
    EXPECT_EQ(accuracy_of(sampling + R"("max_depth": 3)").cutoff, std::nullopt);
  }
}

TEST(Requirements, NeedLensForMoreThanOneSample) {
  tracer::Scene scene = accepted(document_with()).scene;
  scene.camera.aperture = 0.5;
  scene.accuracy.samples = 1;
  EXPECT_TRUE(tracer::requirements(scene).lens) << "adaptive samples";
  scene.accuracy.adaptive.reset();
  EXPECT_FALSE(tracer::requirements(scene).lens);
  scene.accuracy.samples = 2;
  EXPECT_TRUE(tracer::requirements(scene).lens);
}

}  // namespace
