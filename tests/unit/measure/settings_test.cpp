// The settings that a measurement of simple scenes has.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/scenes.h"
#include "tracer/measurement.h"

namespace {

using Titles = std::vector<std::string>;

Titles titles(const tracer::Scene& scene, Titles parameters = {}) {
  Titles titles;
  for (const tracer::Setting& setting : tracer::settings(scene, parameters)) titles.push_back(title(setting));
  return titles;
}

/// Expects that `all` has each title of `present` and none of `absent`.
void expect_titles(const Titles& all, const Titles& present, const Titles& absent = {}) {
  for (const std::string& title : present) EXPECT_EQ(std::ranges::count(all, title), 1) << title;
  for (const std::string& title : absent) EXPECT_EQ(std::ranges::count(all, title), 0) << title;
}

/// A lit sphere; its camera sees it.
tracer::Scene sphere(double reflection, double diffuse = 0.5) {
  tracer::Scene scene = scenes::empty(4);
  scene.camera.position = {0, 0, 4};
  tracer::Material material = scenes::mirror(reflection);
  material.color = tracer::Color{1, 1, 1};
  material.diffuse = diffuse;
  material.path = "/materials/glazed";
  scenes::add(scene, tracer::Sphere{}, material);
  scene.lights.push_back(scenes::directional_light({0, 0, -1}));
  scene.accuracy.samples = 5;  // as none of the settings
  return scene;
}

TEST(Settings, VaryDepthAndCutoffOnlyWithReflections) {
  expect_titles(titles(sphere(0)), {}, {"cutoff 0.0001", "cutoff 0.1", "max_depth 1", "max_depth 8"});
  expect_titles(titles(sphere(0.5)), {"cutoff 0.0001", "cutoff 0.1", "max_depth 1", "max_depth 8"});
}

TEST(Settings, ApproximateOnlyWhatTheSceneHas) {
  tracer::Scene scene = sphere(0);
  expect_titles(titles(scene), {"approximate shadows: map"},
                {"approximate shading: flat", "approximate reflections: none", "approximate lights: nearest-1"});
  scene.lights.front().shadows = false;
  expect_titles(titles(scene), {}, {"approximate shadows: map"});
  scene = sphere(0.5);
  scene.lights.assign(5, {tracer::PointLight{}});
  // There is nothing but black around the scene.
  expect_titles(titles(scene), {"approximate lights: nearest-4", "approximate reflections: none"},
                {"approximate lights: nearest-16", "approximate reflections: environment"});
  scene.background.color = {1, 1, 1};
  expect_titles(titles(scene), {"approximate reflections: environment"});
}

TEST(Settings, CompareModelsByNameOrIfTheSceneIsLitGlobally) {
  tracer::Scene scene = sphere(0.5);
  expect_titles(titles(scene), {}, {"model whitted: 16 samples"});
  expect_titles(titles(scene, {"model"}), {"model fitted ambient: target 0.5", "model path: 16 samples"});
  scene.accuracy.model = tracer::Accuracy::Model::global;
  expect_titles(titles(scene), {"model path: target 4"});
  const auto settings = tracer::settings(scene, Titles{"model"});
  EXPECT_EQ(settings.size(), 20u);
  for (const tracer::Setting& setting : settings)
    EXPECT_EQ(setting.accuracy.model == tracer::Accuracy::Model::whitted,
              setting.model == "whitted" || setting.model == "fitted ambient");
}

TEST(Settings, HaveOnlyWhittedsModelIfTheRenderingEquationRefusesTheScene) {
  const tracer::Scene scene = sphere(0.5, 1);
  EXPECT_EQ(titles(scene, {"model"}), (Titles{"model whitted: 16 samples", "model whitted: target 4",
                                              "model whitted: target 1", "model whitted: target 0.5"}));
  EXPECT_TRUE(
      tracer::refusal_of_global(scene).value_or("").starts_with("/materials/glazed gives back 1.5 of the light"));
}

TEST(Settings, IncludeThePresets) {
  EXPECT_EQ(titles(sphere(0), {"target_error"}),
            (Titles{"target_error 8", "target_error 4 (draft)", "target_error 2", "target_error 1 (standard)",
                    "target_error 0.5 (fine)", "target_error 0.25 (reference)"}));
}

TEST(Settings, CompareTheApproximationsOfTheDocumentWithAllExact) {
  tracer::Scene scene = sphere(0);
  scene.accuracy.approximate.shadows = tracer::Approximations::Shadows::none;
  EXPECT_EQ(titles(scene, {"approximate"}),
            (Titles{"approximate all exact", "approximate shadows: map", "samples 16"}));
}

TEST(Settings, IncludeTheDocumentsAccuracyUnlessItIsAnotherSetting) {
  tracer::Scene scene = sphere(0);
  expect_titles(titles(scene), {"document as it is"});
  scene.accuracy.samples = 64;
  expect_titles(titles(scene), {}, {"document as it is"});
  scene.accuracy.samples = 16;
  EXPECT_EQ(titles(scene, {"approximate", "document"}).back(), "samples 16") << "the baseline";
}

}  // namespace
