/// The accuracy section: its fields, and the settings that result from them together.

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/reader/reading.h"
#include "tracer/requirements.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;
using tracer::Accuracy;
using tracer::Approximations;
using tracer::Preset;

std::string with_accuracy(const std::string& members) { return document_with("\"accuracy\": {" + members + "}"); }

Accuracy accuracy_of(const std::string& members) { return accepted(with_accuracy(members)).scene.accuracy; }

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

std::string summary_of(const std::string& members) { return summary_of(accuracy_of(members)); }

TEST(AccuracyReader, DefaultsToTheStandardTargetError) {
  EXPECT_EQ(target_error_of(Preset::standard), 1);
  EXPECT_EQ(summary_of(accepted(document_with()).scene.accuracy), "target 1, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(""), "target 1, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("seed": 7, "max_depth": 3)"), "target 1, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("samples": [3, 50])"), "target 1, budget -, samples 3..50");
}

TEST(AccuracyReader, ResolvesPresetsToTargetErrors) {
  EXPECT_EQ(summary_of(R"("preset": "draft")"), "target 4, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("preset": "standard")"), "target 1, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("preset": "fine")"), "target 0.5, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("preset": "reference")"), "target 0.25, budget -, samples 1..4096");
}

TEST(AccuracyReader, PrefersTargetErrorToPreset) {
  EXPECT_EQ(summary_of(R"("target_error": 2.5)"), "target 2.5, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("preset": "draft", "target_error": 2.5)"), "target 2.5, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("target_error": 255)"), "target 255, budget -, samples 1..4096");
}

TEST(AccuracyReader, AddsNoDefaultTargetToATimeBudget) {
  EXPECT_EQ(summary_of(R"("time_budget_ms": 500)"), "target -, budget 500, samples 1..4096");
  EXPECT_EQ(summary_of(R"("time_budget_ms": 500, "target_error": 2)"), "target 2, budget 500, samples 1..4096");
  EXPECT_EQ(summary_of(R"("time_budget_ms": 500, "preset": "fine")"), "target 0.5, budget 500, samples 1..4096");
}

TEST(AccuracyReader, KeepsTheTargetOfExactSamplesForTheReport) {
  EXPECT_EQ(summary_of(R"("samples": [9, 9])"), "exactly 9, target -");
  EXPECT_EQ(summary_of(R"("samples": [9, 9], "target_error": 2)"), "exactly 9, target 2");
  EXPECT_EQ(summary_of(R"("samples": [9, 9], "preset": "fine")"), "exactly 9, target 0.5");
  EXPECT_EQ(summary_of(R"("samples": [9, 9], "time_budget_ms": 5)"), "exactly 9, target -");
}

TEST(AccuracyReader, ReadsTheTargetOfTheWorstTile) {
  EXPECT_EQ(accuracy_of("").model, Accuracy::Model::whitted);
  EXPECT_EQ(accuracy_of(R"("model": "whitted")").model, Accuracy::Model::whitted);
  EXPECT_EQ(accuracy_of("").tile_target(), std::nullopt);
  EXPECT_FALSE(accuracy_of("").proof);
  EXPECT_EQ(accuracy_of(R"("tile_error": 3.5)").tile_target(), 3.5);
  EXPECT_EQ(accuracy_of(R"("tile_error": 3.5, "samples": [9, 9])").tile_target(), 3.5);
  EXPECT_EQ(summary_of(R"("tile_error": 3.5)"), "target -, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("tile_error": 3.5, "target_error": 2)"), "target 2, budget -, samples 1..4096");
  EXPECT_EQ(summary_of(R"("tile_error": 3.5, "preset": "fine")"), "target 0.5, budget -, samples 1..4096");
}

TEST(AccuracyReader, ReadsEveryFieldOfAdaptiveSampling) {
  const Accuracy accuracy =
      accepted(reader_tests::file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field_of_images.json")).scene.accuracy;
  EXPECT_EQ(summary_of(accuracy), "target 2.5, budget 1500.5, samples 3..300");
  EXPECT_EQ(accuracy.model, Accuracy::Model::global);
  EXPECT_EQ(accuracy.tile_target(), 7.5);
  EXPECT_TRUE(accuracy.proof);
  EXPECT_EQ(accuracy.approximate.shadows, Approximations::Shadows::map);
  EXPECT_EQ(accuracy.approximate.reflections, Approximations::Reflections::environment);
  EXPECT_EQ(accuracy.approximate.shading, Approximations::Shading::flat);
  EXPECT_EQ(accuracy.approximate.interreflection, Approximations::Interreflection::ambient);
  EXPECT_EQ(accuracy.approximate.nearest_lights, 7u);
}

TEST(AccuracyReader, ReadsEveryApproximation) {
  const auto approximate = [](const std::string& members) {
    return accuracy_of(R"("model": "global", "approximate": {)" + members + "}").approximate;
  };
  EXPECT_EQ(accuracy_of("").approximate, Approximations{});
  EXPECT_EQ(approximate(""), Approximations{});
  EXPECT_EQ(approximate(R"("shadows": "none")"), Approximations{.shadows = Approximations::Shadows::none});
  EXPECT_EQ(approximate(R"("shadows": "map")"), Approximations{.shadows = Approximations::Shadows::map});
  EXPECT_EQ(approximate(R"("reflections": "environment")"),
            Approximations{.reflections = Approximations::Reflections::environment});
  EXPECT_EQ(approximate(R"("reflections": "none")"), Approximations{.reflections = Approximations::Reflections::none});
  EXPECT_EQ(approximate(R"("shading": "gouraud")"), Approximations{.shading = Approximations::Shading::gouraud});
  EXPECT_EQ(approximate(R"("shading": "flat")"), Approximations{.shading = Approximations::Shading::flat});
  EXPECT_EQ(approximate(R"("interreflection": "gather")"),
            Approximations{.interreflection = Approximations::Interreflection::gather});
  EXPECT_EQ(approximate(R"("interreflection": "radiosity")"),
            Approximations{.interreflection = Approximations::Interreflection::radiosity});
  EXPECT_EQ(approximate(R"("interreflection": "ambient")"),
            Approximations{.interreflection = Approximations::Interreflection::ambient});
  EXPECT_EQ(approximate(R"("interreflection": "none")"),
            Approximations{.interreflection = Approximations::Interreflection::none});
  EXPECT_EQ(approximate(R"("lights": "nearest-1")"), Approximations{.nearest_lights = 1});
  EXPECT_EQ(approximate(R"("lights": "nearest-1000000")"), Approximations{.nearest_lights = 1'000'000});
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
  EXPECT_EQ(reader_tests::outcome(
                document_with(R"("image": {"width": 8192, "height": 8192}, "accuracy": {"samples": [257, 300]})")),
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

TEST(AccuracyReader, DefaultsCutoffToOneThousandth) {
  for (const char* members : {"", R"("samples": [4, 4])", R"("time_budget_ms": 100)", R"("target_error": 0.5)",
                              R"("target_error": 100)", R"("target_error": 0.5, "samples": [4, 4])"})
    EXPECT_EQ(accuracy_of(members).cutoff, 1e-3) << members;
  EXPECT_EQ(accuracy_of(R"("target_error": 0.5, "cutoff": 0.25)").cutoff, 0.25);
}

TEST(AccuracyReader, EnablesRussianRouletteForAdaptiveSamplingWithoutCutoff) {
  for (const char* members : {"", R"("samples": [1, 4])", R"("time_budget_ms": 100)", R"("target_error": 0.5)"})
    EXPECT_TRUE(accuracy_of(members).cutoff_by_chance) << members;
  for (const char* members :
       {R"("samples": [4, 4])", R"("cutoff": 0.001)", R"("cutoff": 0)", R"("time_budget_ms": 100, "cutoff": 0.5)"})
    EXPECT_FALSE(accuracy_of(members).cutoff_by_chance) << members;
}

TEST(AccuracyReader, DefaultsToADepthThatRussianRouletteDoesNotReach) {
  for (const char* members : {"", R"("samples": [1, 4])", R"("time_budget_ms": 100)", R"("target_error": 0.5)",
                              R"("tile_error": 0.5)", R"("cutoff": 0.001)"})
    EXPECT_EQ(accuracy_of(members).max_depth, 1000u) << members;
  for (const char* members : {R"("samples": [4, 4])", R"("samples": [4, 4], "target_error": 0.5)", R"("cutoff": 0)"})
    EXPECT_EQ(accuracy_of(members).max_depth, 64u) << members;
  EXPECT_EQ(accuracy_of(R"("max_depth": 64)").max_depth, 64u);
  EXPECT_EQ(accuracy_of(R"("max_depth": 3, "samples": [4, 4])").max_depth, 3u);
}

TEST(Requirements, NeedLensForMoreThanOneSample) {
  const auto lens = [](const std::string& accuracy) {
    return tracer::requirements(accepted(R"({"version": 1, "camera": {"position": [0,0,1], "look_at": [0,0,0],
                                             "aperture": 0.5}, "accuracy": {)" +
                                         accuracy + "}}")
                                    .scene)
        .lens;
  };
  EXPECT_TRUE(lens(""));
  EXPECT_TRUE(lens(R"("samples": [2, 2])"));
  EXPECT_FALSE(lens(R"("samples": [1, 1])"));
}

}  // namespace
