// Pareto front and advice of synthetic points, and the settings of simple scenes.
#include "tracer/measurement.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using tracer::MeasuredPoint;
using tracer::Measurement;

MeasuredPoint point(const char* parameter, const char* value, double seconds, double error, double claimed = 100) {
  MeasuredPoint point;
  point.setting = {parameter, value, {}};
  point.seconds = seconds;
  point.error = error;
  point.claimed.estimate = claimed;
  return point;
}

Measurement measurement(std::vector<MeasuredPoint> points) {
  Measurement measurement;
  measurement.points = std::move(points);
  return measurement;
}

bool contains(const Measurement& measurement, const std::string& sentence) {
  const auto sentences = tracer::advice(measurement);
  return std::find(sentences.begin(), sentences.end(), sentence) != sentences.end();
}

std::vector<std::string> titles(const tracer::Scene& scene, std::vector<std::string> parameters = {}) {
  std::vector<std::string> titles;
  for (const tracer::Setting& setting : tracer::settings(scene, parameters)) titles.push_back(title(setting));
  return titles;
}

bool has(const std::vector<std::string>& titles, const char* title) {
  return std::find(titles.begin(), titles.end(), title) != titles.end();
}

tracer::Scene sphere(double reflection) {
  tracer::Scene scene;
  tracer::Material material;
  material.reflection = reflection;
  scene.materials.push_back(material);
  scene.objects.push_back({tracer::Sphere{}, {0}, {}});
  scene.lights.push_back({tracer::DirectionalLight{}});
  scene.accuracy.samples = 5;  // as none of the settings
  return scene;
}

TEST(ParetoFront, HasTheNonDominatedPointsFastestFirst) {
  const std::vector points{point("a", "slow and exact", 9, 0.1), point("a", "beaten by both", 9.5, 5),
                           point("a", "fast and rough", 1, 8), point("a", "as slow, but rougher", 9, 0.2),
                           point("a", "between", 3, 2)};
  EXPECT_EQ(tracer::pareto_front(points), (std::vector<std::size_t>{2, 4, 0}));
}

TEST(ParetoFront, HasOnlyTheFirstOfEqualPoints) {
  const std::vector points{point("a", "1", 1, 2), point("a", "2", 1, 2), point("a", "3", 2, 2)};
  EXPECT_EQ(tracer::pareto_front(points), std::vector<std::size_t>{0});
  EXPECT_TRUE(tracer::pareto_front({}).empty());
}

TEST(Advice, OfNoPointsIsEmpty) { EXPECT_TRUE(tracer::advice({}).empty()); }

TEST(Advice, NamesTheCheapestSettingWithinEachError) {
  const auto measured = measurement({point("target_error", "4", 0.125, 3.5), point("samples", "1", 0.25, 3),
                                     point("target_error", "1", 0.4, 0.99), point("target_error", "0.5", 2, 0.5)});
  EXPECT_TRUE(contains(measured,
                       "for 4 levels: target_error 4, 0.12 s; for 1 level: target_error 1, 0.40 s; for 0.5 levels: "
                       "target_error 0.5, 2.0 s"))
      << tracer::advice(measured).front();
}

TEST(Advice, NamesTheBestPointIfNoneIsWithinTheError) {
  const auto measured = measurement({point("samples", "1", 0.2, 3), point("samples", "4", 0.8, 1.5)});
  EXPECT_TRUE(contains(measured,
                       "for 4 levels: samples 1, 0.20 s; for 1 level: no setting, the best is samples 4, 0.80 s and "
                       "1.5 levels"))
      << tracer::advice(measured).front();
}

TEST(Advice, NamesTheValueBeyondWhichAParameterHasNoEffect) {
  const auto measured = measurement({point("cutoff", "0.1", 1, 5), point("cutoff", "0.01", 1, 1.04),
                                     point("cutoff", "0.001", 1, 1.01), point("cutoff", "0.0001", 2, 1)});
  EXPECT_TRUE(contains(measured, "cutoff below 0.01 does not reduce the error"));
}

TEST(Advice, ReportsIfTheLastValueStillReducesTheError) {
  const auto measured = measurement({point("max_depth", "4", 1, 5), point("max_depth", "8", 1, 2)});
  EXPECT_TRUE(contains(measured, "max_depth 8 still reduces the error: 2.0 levels instead of 5.0 with 4"));
}

TEST(Advice, ReportsGainAndCostOfApproximations) {
  const auto measured =
      measurement({point("samples", "16", 2, 1), point("approximate", "shadows: map", 1.4, 4.1),
                   point("approximate", "shadows: none", 2.5, 1.01), point("approximate", "shading: flat", 1.99, 3)});
  EXPECT_TRUE(contains(measured, "shadows: map saves 30 % and costs 3.1 levels"));
  EXPECT_TRUE(contains(measured, "shadows: none takes 25 % longer and does not increase the error"));
  EXPECT_TRUE(contains(measured, "shading: flat saves no time and costs 2.0 levels"));
}

TEST(Advice, ReportsClaimedErrorsBelowTheTrueOnes) {
  EXPECT_TRUE(contains(measurement({point("samples", "1", 1, 2, 2)}),
                       "the true error was within the claimed one in all 1 settings"));
  const auto measured = measurement({point("samples", "1", 1, 6, 5), point("samples", "4", 2, 3, 1.5)});
  EXPECT_TRUE(
      contains(measured,
               "the true error was above the claimed one in 2 of 2 settings, by the largest factor with samples 4: 3.0 "
               "levels, claimed 1.5"));
}

TEST(Settings, VaryDepthAndCutoffOnlyWithReflections) {
  EXPECT_FALSE(has(titles(sphere(0)), "cutoff 0.1"));
  EXPECT_FALSE(has(titles(sphere(0)), "max_depth 1"));
  EXPECT_TRUE(has(titles(sphere(0.5)), "cutoff 0.0001"));
  EXPECT_TRUE(has(titles(sphere(0.5)), "max_depth 8"));
}

TEST(Settings, ApproximateOnlyWhatTheSceneHas) {
  tracer::Scene scene = sphere(0);
  EXPECT_TRUE(has(titles(scene), "approximate shadows: map"));
  EXPECT_FALSE(has(titles(scene), "approximate shading: flat"));
  EXPECT_FALSE(has(titles(scene), "approximate reflections: none"));
  EXPECT_FALSE(has(titles(scene), "approximate lights: nearest-1"));
  scene.lights.front().shadows = false;
  EXPECT_FALSE(has(titles(scene), "approximate shadows: map"));
  scene = sphere(0.5);
  scene.lights.assign(5, {tracer::PointLight{}});
  EXPECT_TRUE(has(titles(scene), "approximate lights: nearest-4"));
  EXPECT_FALSE(has(titles(scene), "approximate lights: nearest-16"));
  EXPECT_TRUE(has(titles(scene), "approximate reflections: none"));
  EXPECT_FALSE(has(titles(scene), "approximate reflections: environment")) << "there is nothing but black";
  scene.background.color = {1, 1, 1};
  EXPECT_TRUE(has(titles(scene), "approximate reflections: environment"));
}

TEST(Settings, IncludeThePresets) {
  const auto found = titles(sphere(0), {"target_error"});
  EXPECT_EQ(found, (std::vector<std::string>{"target_error 8", "target_error 4 (draft)", "target_error 2",
                                             "target_error 1 (standard)", "target_error 0.5 (fine)",
                                             "target_error 0.25 (reference)"}));
}

TEST(Settings, IncludeTheBaselineOfParametersThatVaryIt) {
  EXPECT_TRUE(has(titles(sphere(0), {"approximate"}), "samples 16"));
  EXPECT_FALSE(has(titles(sphere(0), {"target_error"}), "samples 16"));
}

TEST(Settings, IncludeTheDocumentsAccuracyUnlessItIsAnotherSetting) {
  tracer::Scene scene = sphere(0);
  EXPECT_TRUE(has(titles(scene), "document as it is"));
  scene.accuracy.samples = 64;
  EXPECT_FALSE(has(titles(scene), "document as it is"));
}

}  // namespace
