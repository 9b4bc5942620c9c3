// Whitted's model beside the rendering equation, from references of small scenes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/measure.h"
#include "tracer/src/measure/model_comparison.h"

namespace tracer {
namespace {

constexpr std::uint32_t side = 12, reference_samples = 512;

Material diffuse(const Color& color) {
  Material material = scenes::matte(color);
  material.diffuse = 0.9;
  return material;
}

/// Two colored walls that meet over a floor, and a ball, in front of black.
Scene corner() {
  Scene scene = scenes::empty(side, {{2, 1.2, 2}, {-0.3, 0.4, -0.3}, {0, 1, 0}, 60});
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, diffuse({0.8, 0.8, 0.8}));
  scenes::add(scene, Plane{{-1, 0, 0}, {1, 0, 0}, {}}, diffuse({0.8, 0.1, 0.1}));
  scenes::add(scene, Plane{{0, 0, -1}, {0, 0, 1}, {}}, diffuse({0.1, 0.7, 0.2}));
  scenes::add(scene, Sphere{{0, 0.4, 0}, 0.4}, diffuse({0.9, 0.9, 0.9}));
  return scene;
}

Scene lit_by_a_point() {
  Scene scene = corner();
  scene.lights.push_back(scenes::point_light({1.5, 2.5, 1}, {0.8, 0.8, 0.8}));
  return scene;
}

Scene lit_by_a_lamp() {
  Scene scene = corner();
  scenes::add(scene, Sphere{{0.5, 1.8, 0.6}, 0.4}, scenes::glowing({5, 4, 3}));
  return scene;
}

Scene lit_by_the_sky() {
  Scene scene = corner();
  scene.background.color = {0.3, 0.4, 0.6};
  return scene;
}

Scene lit_by_everything() {
  Scene scene = lit_by_a_point();
  scenes::add(scene, Sphere{{0.5, 1.8, 0.6}, 0.2}, scenes::glowing({5, 4, 3}));
  scene.background.color = {0.1, 0.15, 0.2};
  scene.ambient = {0.05, 0.1, 0.15};
  return scene;
}

Scene with_a_mirror() {
  Scene scene = lit_by_a_point();
  scenes::add(scene, Sphere{{-0.4, 1.1, -0.4}, 0.35}, scenes::mirror(0.9));
  scene.ambient = {0.3, 0.3, 0.3};
  return scene;
}

const std::vector<std::pair<const char*, Scene (*)()>> lit{{"point", lit_by_a_point},
                                                           {"lamp", lit_by_a_lamp},
                                                           {"sky", lit_by_the_sky},
                                                           {"everything", lit_by_everything},
                                                           {"mirror", with_a_mirror}};

/// Glass, a leaf, a checker and a second light.
Scene with_other_materials() {
  Scene scene = lit_by_a_point();
  scene.lights.push_back(scenes::directional_light({-1, -2, -0.5}, {0.3, 0.35, 0.5}));
  scene.ambient = {0.1, 0.02, 0.02};
  scenes::add(scene, Sphere{{0.5, 0.7, 0.8}, 0.4}, scenes::glass());
  Material leaf = diffuse({0.2, 0.6, 0.1});
  leaf.diffuse_transmission = 0.5;
  leaf.diffuse_transmission_color = Color{0.3, 0.7, 0.2};
  scenes::add(scene, Triangle{{{{-0.8, 0.2, 0.6}, {0.9, 0.3, 0.9}, {0, 1.5, 0.2}}}, {}, {}}, leaf);
  scene.textures.push_back({CheckerTexture{{Color{0.1, 0.1, 0.3}, Color{0.9, 0.8, 0.3}}}, {3, 3}, {}, "/textures/t"});
  Material tiles = diffuse({});
  tiles.color = TextureId{0};
  scenes::add(scene, Box{{-0.95, 0.01, 0.3}, {-0.3, 0.6, 0.9}}, tiles);
  return scene;
}

Scene of_a_mesh_in_a_sphere() {
  Scene scene = scenes::empty(side, {{0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 60});
  scenes::add(scene, Sphere{{0, 0, 0}, 3}, diffuse({0.6, 0.5, 0.4}));
  scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.7, {0.3, -0.2, 0}), diffuse({0.3, 0.4, 0.8}));
  scene.lights.push_back(scenes::point_light({-1, 1, 1}, {0.4, 0.4, 0.4}));
  return scene;
}

MeasureSettings settings(std::vector<std::string> parameters, std::uint32_t samples) {
  const auto seconds = [now = 0.0]() mutable { return now += 1; };
  return {.parameters = std::move(parameters), .reference_samples = samples, .threads = 2, .seconds = seconds};
}

struct Compared {
  ModelError error;
  Reference whitted, global;
};

Compared compare(const Scene& scene) {
  const Assets assets;
  RenderControl control;
  MeasurementRun run(scene, assets, settings({"model"}, reference_samples));
  while (!run.measurement().model_error) EXPECT_FALSE(run.step(control).has_value());
  const bool is_whitted = scene.accuracy.model == Accuracy::Model::whitted;
  return {*run.measurement().model_error, run.references()[is_whitted ? 0 : 1], run.references()[is_whitted ? 1 : 0]};
}

Color mean(const Reference& reference) {
  const Image image = mean_image(reference);
  double sums[3] = {};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) sums[i % 3] += image.rgb[i];
  const double pixels = side * side;
  return {sums[0] / pixels, sums[1] / pixels, sums[2] / pixels};
}

TEST(ModelError, ByCauseSumsToTheDifferenceOfTheReferences) {
  for (const auto& [name, make] : lit) {
    const Compared compared = compare(make());
    const LightByCause& by = compared.error.by;
    const Color whitted = mean(compared.whitted), global = mean(compared.global);
    for (double Color::*c : {&Color::r, &Color::g, &Color::b}) {
      const double sum = by.interreflection.*c + by.emission.*c + by.environment.*c + by.ambient.*c;
      EXPECT_NEAR(sum, global.*c - whitted.*c, 0.03 * (global.*c)) << name;
    }
  }
}

TEST(ModelError, ByCauseNamesTheSourcesOfTheScene) {
  const auto parts = [](const Scene& scene) {
    const LightByCause by = compare(scene).error.by;
    return std::vector<bool>{by.interreflection.g > 0, by.emission.g > 0, by.environment.g > 0, by.ambient.g < 0};
  };
  EXPECT_EQ(parts(lit_by_a_point()), (std::vector<bool>{true, false, false, false}));
  EXPECT_EQ(parts(lit_by_a_lamp()), (std::vector<bool>{false, true, false, false}));
  EXPECT_EQ(parts(lit_by_the_sky()), (std::vector<bool>{false, false, true, false}));
  EXPECT_EQ(parts(lit_by_everything()), (std::vector<bool>{true, true, true, true}));
}

/// The distance of Whitted's image with this ambient light from the rendering equation.
double error_with(Scene scene, const Color& ambient, const Reference& global) {
  scene.accuracy.model = Accuracy::Model::whitted;
  scene.ambient = ambient;
  Reference reference = empty_reference(scene, reference_samples);
  for (std::uint32_t i = 0; i < 4; ++i) add(reference, scenes::render(reference_scene(scene, reference), 2).image);
  return distance(to_display(global, scene.output), 0, to_display(reference, scene.output));
}

TEST(ModelError, NoAmbientLightCloseToTheFittedOneIsBetter) {
  for (const auto& [name, make] : lit) {
    const Scene scene = make();
    const Compared compared = compare(scene);
    const Color fitted = compared.error.fitted_ambient;
    EXPECT_LE(compared.error.fitted_levels, compared.error.levels) << name;
    const double best = error_with(scene, fitted, compared.global);
    EXPECT_NEAR(best, compared.error.fitted_levels, 0.05 * best + 0.1) << name;
    for (const double factor : {0.8, 0.9, 1.1, 1.2}) {
      const Color other{fitted.r * factor, fitted.g * factor, fitted.b * factor};
      EXPECT_GE(error_with(scene, other, compared.global), best) << name << " times " << factor;
    }
    for (double Color::*c : {&Color::r, &Color::g, &Color::b})
      for (const double factor : {0.8, 1.2}) {
        Color other = fitted;
        other.*c *= factor;
        EXPECT_GE(error_with(scene, other, compared.global), best - 1e-3) << name << " times " << factor;
      }
  }
}

Rendered render_with(Scene scene, Approximations::Interreflection interreflection, std::uint32_t samples) {
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.approximate.interreflection = interreflection;
  scene.accuracy.samples = samples;
  return scenes::render(scene, 2);
}

TEST(ModelError, IsZeroWithoutDiffuseSurfaces) {
  Scene scene = scenes::empty(side, {{0, 0, 4}, {0, 0, 0}});
  scene.background.color = {0.2, 0.5, 0.3};
  scenes::add(scene, Sphere{{-0.6, 0, 0}, 0.6}, scenes::mirror(0.8));
  scenes::add(scene, Sphere{{0.6, 0, 0}, 0.5}, scenes::glowing({0.7, 0.2, 0.1}));
  const ModelError error = compare(scene).error;
  EXPECT_LE(error.levels, 2 * error.standard_error);
  EXPECT_LT(error.standard_error, 1);
  scene.accuracy.adaptive.emplace().target_error = 1;  // looks go on until they exclude more
  EXPECT_LE(render_with(scene, Approximations::Interreflection::ambient, 16).error.approximation, 1);
}

/// The interval of the part `approximation` of an error estimate has values in common with levels +- deviation.
void expect_agreement(const ErrorEstimate& claimed, double levels, double deviation, const std::string& of) {
  EXPECT_LE(claimed.approximation_min, levels + deviation) << of;
  EXPECT_GE(claimed.approximation, levels - deviation) << of;
}

TEST(ModelError, IsThatOfTheErrorEstimateOfARender) {
  using enum Approximations::Interreflection;
  auto all = lit;
  all.emplace_back("other materials", with_other_materials);
  all.emplace_back("sphere", of_a_mesh_in_a_sphere);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& [name, make] = all[i];
    const Scene scene = make();
    const Compared compared = compare(scene);
    const ErrorEstimate claimed = render_with(scene, ambient, 4096).error;
    expect_agreement(claimed, compared.error.levels, compared.error.standard_error, name);
    EXPECT_GT(claimed.approximation_min, 0.5 * compared.error.levels) << name;
    EXPECT_LT(claimed.approximation, 1.5 * compared.error.levels) << name;
    constexpr std::array others{none, radiosity, gather};
    const Rendered other = render_with(scene, others[i % others.size()], 512);
    const double noise = std::hypot(standard_error(compared.global, scene.output), other.error.sampling);
    const double levels =
        distance(to_display(compared.global, scene.output), noise, to_display(other.image, scene.output));
    expect_agreement(other.error, levels, noise, std::string(name) + " otherwise");
  }
}

TEST(ModelError, IsNotMeasuredIfAnImageFileIsTooBrightForTheRenderingEquation) {
  Scene scene = lit_by_a_point();
  const Assets assets{{encode({1, 1, {1.5F, 0.5F, 0.5F}}, Format::exr)->bytes}};
  scene.assets = {{"bright.exr", "/textures/bright/file"}};
  scene.textures.push_back({ImageTexture{}, {1, 1}, {}, "/textures/bright"});
  scene.materials.back().color = TextureId{0};
  scene.materials.back().path = "/materials/bright";
  RenderControl control;
  MeasurementRun run(scene, assets, settings({"samples", "model"}, 16));
  while (!run.done()) {
    ASSERT_FALSE(run.step(control).has_value());
    EXPECT_LE(run.steps_done(), run.steps());
  }
  const Measurement measured = run.measurement();
  EXPECT_TRUE(measured.not_measured.value_or("").starts_with(
      "/materials/bright: the texture of a material: it gives back 1.35 of the light"))
      << measured.not_measured.value_or("");
  EXPECT_EQ(measured.points.size(), 8u) << "four numbers of samples, and Whitted's model at four settings";
  EXPECT_FALSE(measured.model_error);
  scene.accuracy.model = Accuracy::Model::global;
  MeasurementRun refused(scene, assets, settings({"model"}, 16));
  EXPECT_EQ(refused.step(control)->code, Failure::Code::bad_asset);
}

TEST(ModelError, IsTheSameFromEitherModel) {
  Scene scene = lit_by_a_point();
  const ModelError from_whitted = compare(scene).error;
  scene.accuracy.model = Accuracy::Model::global;
  const ModelError from_global = compare(scene).error;
  EXPECT_EQ(from_whitted.levels, from_global.levels);
  EXPECT_EQ(from_whitted.fitted_levels, from_global.fitted_levels);
}

/// The points up to the first of radiosity; the others of it take longer.
TEST(ModelError, IsAddedToThatOfEachImage) {
  const Scene scene = lit_by_the_sky();
  const Assets assets;
  RenderControl control;
  MeasurementRun run(scene, assets, settings({"model"}, 256));
  while (run.measurement().points.size() < 9) ASSERT_FALSE(run.step(control).has_value());
  const Measurement measured = run.measurement();
  EXPECT_EQ(measured.points.back().setting.model, "radiosity");
  const double whitted = measured.model_error->levels;
  for (const MeasuredPoint& point : measured.points) {
    const std::string& model = point.setting.model;
    if (point.setting.accuracy.approximate.any()) {
      EXPECT_EQ(point.error, point.total_error) << title(point.setting);
      EXPECT_LE(*point.model_error, *point.total_error + 1) << title(point.setting);
      EXPECT_LE(*point.model_error, whitted / 4) << title(point.setting);
      continue;
    }
    const double expected = model == "whitted" ? whitted : measured.model_error->fitted_levels;
    EXPECT_EQ(point.model_error, expected) << title(point.setting);
    EXPECT_NEAR(*point.total_error, std::hypot(point.error, expected), 0.1 * expected + 0.5) << title(point.setting);
  }
  EXPECT_FALSE(model_front(measured, "whitted").empty());
}

}  // namespace
}  // namespace tracer
