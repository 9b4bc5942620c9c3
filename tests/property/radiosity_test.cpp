// Radiosity and gathering, against closed forms and against paths.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "tests/property/global_radiance.h"
#include "tracer/scene_cache.h"

namespace tracer {
namespace {

using Interreflection = Approximations::Interreflection;

Rendered rendered_with(Scene scene, Interreflection interreflection) {
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.max_depth = 1000;
  scene.accuracy.approximate.interreflection = interreflection;
  return scenes::render(scene);
}

Scene view_from_center() {
  Scene scene = scenes::empty(24, {{0, 0, 0}, {0.3, 1, 0.2}, {0, 0.6, 0.8}, 90});
  return scene;
}

TEST(Radiosity, OfAnIntegratingSphereIsTheClosedForm) {
  constexpr double rho = 0.6, intensity = 2, radius = 1.5;
  for (const Vec3& position : {Vec3{0, 0, 0}, Vec3{0.5, 0, 0}, Vec3{-0.6, 0.6, 0.6}}) {
    Scene scene = view_from_center();
    scenes::add(scene, Sphere{{0, 0, 0}, radius}, surface(rho));
    scene.lights.push_back(scenes::point_light(position, {intensity, intensity, intensity}));
    scene.lights.back().attenuation.kind = Attenuation::Kind::inverse_square;
    const double direct = mean_radiance(rendered_with(scene, Interreflection::none).image);
    const double truth = rho * rho * intensity / (radius * radius * (1 - rho));
    const auto indirect = [&](Interreflection by) { return mean_radiance(rendered_with(scene, by).image) - direct; };
    EXPECT_NEAR(indirect(Interreflection::radiosity), truth, 0.01 * truth) << position.x;
    EXPECT_NEAR(indirect(Interreflection::gather), truth, 0.02 * truth) << position.x;  // one ray a hit: noise
  }
}

TEST(Radiosity, OfAClosedSceneIsTheEmissionOverTheAbsorptance) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    Scene scene = view_from_center();
    scene.accuracy.samples = 16;
    scenes::add(scene, Sphere{{0, 0, 0}, 3}, surface(rho, 1));
    scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.5, {0.4, 2, 0.2}), surface(rho, 1));
    const double truth = 1 / (1 - rho);
    EXPECT_NEAR(mean_radiance(rendered_with(scene, Interreflection::radiosity).image), truth, 0.01 * truth) << rho;
  }
}

TEST(Radiosity, OfAPlaneBelowAGlowingSphereIsTheClosedForm) {
  constexpr double rho = 0.8, radius = 0.5, height = 1.2, radiance = 5;
  for (const double aside : {0.0, 1.0, 3.0}) {
    Scene scene = scenes::empty(4, {{aside, 0, 0.5}, {aside, 0, 0}, {0, 1, 0}, 0.1});
    scene.accuracy.samples = 64;
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(rho));
    scenes::add(scene, Sphere{{0, 0, height}, radius}, scenes::glowing({radiance, radiance, radiance}));
    const double distance = std::hypot(height, aside);
    const double truth = rho * radiance * radius * radius * height / std::pow(distance, 3);
    const double seen = mean_radiance(rendered_with(scene, Interreflection::radiosity).image);
    EXPECT_NEAR(seen, truth, 0.01 * truth) << aside;
  }
}

TEST(Radiosity, UnderAUniformSkyIsTheReflectanceOfAConvexBody) {
  Scene scene = scenes::empty(16, {{0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 10});
  scene.background.color = {0.5, 1, 2};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, surface(0.8));
  for (const auto by : {Interreflection::radiosity, Interreflection::gather}) {
    const Image seen = rendered_with(scene, by).image;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(mean_radiance(seen, c), 0.4 * std::pow(2.0, c), 1e-6);
  }
}

TEST(Radiosity, IsWithinItsClaimOfPaths) {
  Scene scene = scenes::room();
  scene.accuracy.samples = 64;
  Scene converged = scene;
  converged.accuracy.samples = 1024;
  const DisplayImage truth = to_display(rendered_with(converged, Interreflection::exact).image);
  const auto error_of = [&](Interreflection by) {
    const Rendered seen = rendered_with(scene, by);
    const double error = compare(truth, to_display(seen.image))->rmse;
    EXPECT_LE(error, seen.error.estimate + 1) << static_cast<int>(by);  // the reference has noise
    return error;
  };
  const double paths = error_of(Interreflection::exact);
  EXPECT_LT(error_of(Interreflection::radiosity), 4);
  EXPECT_LT(error_of(Interreflection::gather), paths) << "gathering has no more noise than paths";
  EXPECT_GT(error_of(Interreflection::none), 10);
}

TEST(Radiosity, LeavesTheSamplesTheRestOfTheTargetError) {
  Scene scene = scenes::room();
  scene.image = {96, 96, {}};
  scene.accuracy.adaptive = Adaptive{.target_error = 4, .time_budget_ms = {}};
  scenes::end_by_chance(scene);
  const ErrorEstimate error = rendered_with(scene, Interreflection::radiosity).error;
  EXPECT_TRUE(error.target_met) << error.estimate;
  EXPECT_EQ(error.limit, ErrorEstimate::Limit::target);
  EXPECT_GT(error.approximation, 1);
  EXPECT_LT(error.sampling, 3.8) << "samples that reach the target alone do not suffice";
  EXPECT_NEAR(std::hypot(error.sampling, error.approximation), error.estimate, 0.2);
}

std::optional<RadiosityFigures> figures_of(Scene scene, Interreflection interreflection, double target) {
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.target_error = target;
  scene.accuracy.approximate.interreflection = interreflection;
  return radiosity_figures(*scenes::compiled(scene));
}

TEST(Radiosity, HasMorePatchesAndRaysForASmallerTargetAndReportsThem) {
  EXPECT_FALSE(figures_of(scenes::room(), Interreflection::exact, 1));
  EXPECT_FALSE(figures_of(scenes::room(), Interreflection::ambient, 1));
  const auto coarse = figures_of(scenes::room(), Interreflection::radiosity, 16),
             fine = figures_of(scenes::room(), Interreflection::radiosity, 2);
  ASSERT_TRUE(coarse && fine);
  EXPECT_EQ(coarse->stages, 1u);
  EXPECT_GT(fine->stages, 1u);
  EXPECT_GT(fine->factors, 2 * coarse->factors);
  EXPECT_GE(coarse->patches, 1024u);
  EXPECT_LE(coarse->patches, 1300u) << "cells at borders are cut";
  EXPECT_GE(coarse->rays, 128u * coarse->patches);
  for (const RadiosityFigures& figures : {*coarse, *fine}) {
    EXPECT_GT(figures.factors, 10u * figures.patches);
    EXPECT_LT(figures.factors, figures.rays);
    EXPECT_GT(figures.sweeps, 2u);
    EXPECT_LT(figures.bound, 1e-4);
    EXPECT_FALSE(figures.limited);
  }
}

TEST(Radiosity, OfWallsThatAbsorbNothingEndsAndIsReportedAsUnbounded) {
  Scene scene = view_from_center();
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, surface(1, 0.01));
  const auto figures = figures_of(scene, Interreflection::radiosity, 4);
  EXPECT_EQ(figures->bound, std::numeric_limits<double>::infinity());
  EXPECT_LE(figures->sweeps, 1000u);
  scene.image = {4, 4, {}};
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.max_depth = 8;  // of the looks
  scene.accuracy.approximate.interreflection = Interreflection::radiosity;
  EXPECT_FALSE(scenes::render(scene).error.bounded);
}

struct Built {
  bool reused = false, did_work = false;
  RadiosityFigures figures;
  std::shared_ptr<const CompiledScene> scene;
};

Built built_with(SceneCache& cache, Scene scene, const std::string& everything_but_the_view = "scene") {
  scene.accuracy.model = Accuracy::Model::global;
  if (!scene.accuracy.adaptive) scene.accuracy.target_error = 4;
  scene.accuracy.approximate.interreflection = Interreflection::radiosity;
  RenderControl control;
  const auto entry = *cache.acquire(scene, {}, control, everything_but_the_view);
  const auto compiled = *compile(scene, control, {}, entry.get(), [] { return 0.0; });
  return {cache_hits(*compiled).radiosity, control.progress() > 0, *radiosity_figures(*compiled), compiled};
}

TEST(Radiosity, IsReusedByScenesThatDifferInTheView) {
  SceneCache cache(64u << 20);
  EXPECT_FALSE(built_with(cache, scenes::room(), "a").reused);
  EXPECT_GT(cache.memory_bytes().radiosity, 0u);
  Scene moved = scenes::room();
  moved.camera.position = {0.5, 0.25, 2};
  moved.camera.up = {0.5, 1, 0.25};
  moved.image = {64, 16, {}};
  EXPECT_TRUE(built_with(cache, moved, "a").reused);
  EXPECT_FALSE(built_with(cache, scenes::room(), "b").reused) << "another scene";
  EXPECT_FALSE(built_with(cache, scenes::room(), "").reused) << "of unknown content";
  Scene turned = scenes::room();
  turned.background.up = {1, 0, 0};
  EXPECT_FALSE(built_with(cache, turned, "a").reused) << "another zenith";
  turned.background.up.reset();
  EXPECT_TRUE(built_with(cache, turned, "a").reused) << "the camera's, which is y";
  turned.camera.up = {0.5, 1, 0.25};
  EXPECT_FALSE(built_with(cache, turned, "a").reused) << "the sky turns with the camera";
  Scene with_file = scenes::room();
  with_file.assets.push_back({"image.png", "/textures/wood/file"});
  EXPECT_FALSE(built_with(cache, with_file, "a").reused) << "of a file of unknown content";
}

/// A gray ball between mirrors: each ray takes so many others that a limit ends the refinement.
Scene ball_between_mirrors() {
  Scene scene = scenes::empty(8, {{0.3, 0.2, 0.8}, {0, 0, 0}, {0, 1, 0}, 60});
  scene.accuracy.max_depth = 1000;
  scene.accuracy.adaptive = Adaptive{.target_error = 0.01, .time_budget_ms = 1000};
  scenes::end_by_chance(scene);
  scenes::add(scene, Box{{-1, -1, -1}, {1, 1, 1}}, scenes::mirror(0.99));
  scenes::add(scene, Sphere{{0, 0, 0}, 0.1}, surface(0.8));
  scene.lights.push_back(scenes::point_light({0.7, 0.5, 0.6}, {0.5, 0.5, 0.5}));
  return scene;
}

void expect_equal(const RadiosityFigures& a, const RadiosityFigures& b, const std::string& of) {
  EXPECT_EQ(std::tie(a.patches, a.limited, a.stages, a.rays, a.factors, a.sweeps, a.bound),
            std::tie(b.patches, b.limited, b.stages, b.rays, b.factors, b.sweeps, b.bound))
      << of;
}

/// Views of a scene: the light and its audit are those of the first, of which all have the same figures.
std::map<std::string, Scene> views_of(const Scene& scene) {
  std::map<std::string, Scene> views;
  const auto view = [&](const char* name) -> Scene& { return views.emplace(name, scene).first->second; };
  view("the same");
  view("from elsewhere").camera.position = {-0.5, 0.25, 0.5};
  view("from outside").camera.position = {0, 0.5, 9};
  view("past everything").camera = {{0, 0, 9}, {0, 0, 20}, {0, 1, 0}, 30};
  view("a panorama").camera.type = Camera::Type::panorama;
  view("with a lens").camera.aperture = 0.125;
  view("another shape").image = {4 * scene.image.width, scene.image.height / 4, {}};
  return views;
}

TEST(Radiosity, IsSolvedAndAuditedOnceForAllViews) {
  for (const bool limited : {false, true}) {
    const Scene scene = limited ? ball_between_mirrors() : scenes::room();
    SceneCache cache(64u << 20);
    const Built first = built_with(cache, scene);
    EXPECT_FALSE(first.reused);
    EXPECT_TRUE(first.did_work);
    EXPECT_EQ(first.figures.limited, limited);
    for (const auto& [name, view] : views_of(scene)) {
      const Built again = built_with(cache, view);
      EXPECT_TRUE(again.reused) << name;
      EXPECT_FALSE(again.did_work) << name;
      expect_equal(again.figures, first.figures, name);
    }
  }
}

TEST(Radiosity, GivesEachViewTheSameImageAndErrorFromTheCacheAndWithout) {
  SceneCache cache(64u << 20), none(0);
  Scene scene = scenes::room();
  scene.depth_cue = DepthCue{.front = 1, .back = 4, .color = {0.5, 0.5, 0.5}};  // by the distance from the camera
  built_with(cache, scene);
  std::map<std::string, Scene> views = views_of(scene);
  for (const char* name : {"brighter", "darker", "scaled", "small"}) views[name] = scene;
  views["brighter"].output.exposure = 2;
  views["darker"].output.exposure = -8;
  views["scaled"].output.overflow = Output::Overflow::scale;
  views["small"].image = {12, 8, {}};
  for (const auto& [name, view] : views) {
    const Built again = built_with(cache, view), fresh = built_with(none, view);
    expect_equal(again.figures, fresh.figures, name);
    RenderControl control;
    const Rendered with = *render(*again.scene, {}, control), without = *render(*fresh.scene, {}, control);
    EXPECT_EQ(with.image.rgb, without.image.rgb) << name;
    EXPECT_EQ(with.error.estimate, without.error.estimate) << name;
    EXPECT_EQ(with.error.approximation, without.error.approximation) << name;
    EXPECT_FALSE(built_with(cache, view).did_work) << name << ", once more";
  }
}

}  // namespace
}  // namespace tracer
