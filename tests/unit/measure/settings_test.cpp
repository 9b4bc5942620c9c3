// The settings that a measurement of simple scenes has.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/scenes.h"
#include "tracer/measurement.h"

namespace {

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

/// A scene that can be rendered.
tracer::Scene valid_sphere(double diffuse, double reflection) {
  tracer::Scene scene = scenes::empty(4);
  scene.camera.position = {0, 0, 4};
  tracer::Material material = scenes::mirror(reflection);
  material.color = tracer::Color{1, 1, 1};
  material.diffuse = diffuse;
  material.path = "/materials/glazed";
  scenes::add(scene, tracer::Sphere{}, material);
  scene.accuracy.samples = 5;  // as none of the settings
  return scene;
}

TEST(Settings, CompareModelsByNameOrIfTheSceneIsLitGlobally) {
  tracer::Scene scene = valid_sphere(0.5, 0.5);
  EXPECT_FALSE(has(titles(scene), "model whitted: 16 samples"));
  EXPECT_TRUE(has(titles(scene, {"model"}), "model fitted ambient: target 0.5"));
  EXPECT_TRUE(has(titles(scene, {"model"}), "model path: 16 samples"));
  scene.accuracy.model = tracer::Accuracy::Model::global;
  EXPECT_TRUE(has(titles(scene), "model path: target 4"));
  for (const tracer::Setting& setting : tracer::settings(scene, std::vector<std::string>{"model"}))
    EXPECT_EQ(setting.accuracy.model == tracer::Accuracy::Model::whitted,
              setting.model == "whitted" || setting.model == "fitted ambient");
  EXPECT_EQ(tracer::settings(scene, std::vector<std::string>{"model"}).size(), 20u);
}

TEST(Settings, HaveOnlyWhittedsModelIfTheRenderingEquationRefusesTheScene) {
  const tracer::Scene scene = valid_sphere(1, 0.5);
  EXPECT_EQ(titles(scene, {"model"}),
            (std::vector<std::string>{"model whitted: 16 samples", "model whitted: target 4", "model whitted: target 1",
                                      "model whitted: target 0.5"}));
  EXPECT_TRUE(
      tracer::refusal_of_global(scene).value_or("").starts_with("/materials/glazed gives back 1.5 of the light"));
}

TEST(Settings, IncludeThePresets) {
  const auto found = titles(sphere(0), {"target_error"});
  EXPECT_EQ(found, (std::vector<std::string>{"target_error 8", "target_error 4 (draft)", "target_error 2",
                                             "target_error 1 (standard)", "target_error 0.5 (fine)",
                                             "target_error 0.25 (reference)"}));
}

TEST(Settings, CompareTheApproximationsOfTheDocumentWithAllExact) {
  tracer::Scene scene = sphere(0);
  scene.accuracy.approximate.shadows = tracer::Approximations::Shadows::none;
  EXPECT_EQ(titles(scene, {"approximate"}),
            (std::vector<std::string>{"approximate all exact", "approximate shadows: map", "samples 16"}));
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
  scene.accuracy.samples = 16;
  EXPECT_EQ(titles(scene, {"approximate", "document"}).back(), "samples 16") << "the baseline";
}

}  // namespace
