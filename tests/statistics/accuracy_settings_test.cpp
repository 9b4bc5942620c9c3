// Effect of each setting of `accuracy` on the true error and on the number of rays. Deterministic: no test reads a
// clock.
#include <gtest/gtest.h>

#include <vector>

#include "tests/support/scenes.h"
#include "tracer/compare.h"
#include "tracer/compile.h"
#include "tracer/measure.h"

namespace {

using namespace tracer;

/// Edges, a mirror, glass, a ball of few triangles, six lights of which two are soft.
Scene still_life() {
  Scene scene = scenes::empty(32);
  scene.camera = {{1, 2, 7}, {0, 0.6, 0}, {0, 1, 0}, 35};
  scene.background.color = {0.2, 0.3, 0.5};
  scene.ambient = {0.05, 0.05, 0.05};
  for (const double x : {-3.0, -1.0, 1.0, 3.0}) scene.lights.push_back(scenes::point_light({x, 4, 2}, {0.2, 0.2, 0.2}));
  for (const double x : {-2.0, 2.0}) {
    Light lamp;
    lamp.source = RectLight{{x, 4, 1}, {1, 0, 0}, {0, 0, 1}};
    lamp.color = {0.3, 0.25, 0.2};
    scene.lights.push_back(lamp);
  }
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.7, 0.7, 0.6}));
  scenes::add(scene, Sphere{{-1.3, 0.7, 0}, 0.7}, scenes::mirror(0.7));
  scenes::add(scene, Sphere{{0.3, 0.6, 0.8}, 0.6}, scenes::glass());
  scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.6, {1.5, 0.6, -0.5}), scenes::matte({0.9, 0.4, 0.2}));
  scene.accuracy.samples = 16;
  return scene;
}

/// Two parallel emissive mirrors of reflectance 0.9: every bounce adds radiance.
Scene corridor() {
  Scene scene = scenes::empty(8);
  scene.camera = {{0, 3, 0}, {1, 0, 0}, {0, 0, 1}, 40};
  Material wall = scenes::mirror(0.9);
  wall.emission = Color{0.04, 0.03, 0.02};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, wall);
  scenes::add(scene, Plane{{0, 6, 0}, {0, 1, 0}, {}}, MaterialId{0});
  return scene;
}

DisplayImage converged(const Scene& scene) {
  constexpr std::uint32_t samples = 1024;
  Reference reference = empty_reference(scene, samples);
  while (reference.images * reference.image_samples < samples)
    add(reference, scenes::render(reference_scene(scene, reference), 2).image);
  return to_display(reference, scene.output);
}

struct Point {
  double error = 0;  ///< levels, measured
  RayCounts rays;
};

Point measured(const Rendered& rendered, const DisplayImage& truth) {
  return {compare(truth, to_display(rendered.image))->rmse, rendered.statistics.rays};
}

/// Computed once.
const DisplayImage& converged_still_life() {
  static const DisplayImage truth = converged(still_life());
  return truth;
}

/// One point for each of `values`, which `set` applies to the accuracy of `scene`.
template <class Values, class Set>
std::vector<Point> curve(const Scene& scene, const DisplayImage& truth, const Values& values, const Set& set) {
  std::vector<Point> points;
  for (const auto& value : values) {
    Scene changed = scene;
    set(changed.accuracy, value);
    points.push_back(measured(scenes::render(changed, 2), truth));
  }
  return points;
}

/// From each point to the next the error decreases and the number of rays increases.
void expect_less_error_with_more_rays(const std::vector<Point>& points) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_LT(points[i].error, points[i - 1].error) << "step " << i;
    EXPECT_GT(points[i].rays.total(), points[i - 1].rays.total()) << "step " << i;
  }
}

TEST(AccuracySamples, ReduceTheErrorAndAddRays) {
  expect_less_error_with_more_rays(curve(still_life(), converged_still_life(), std::vector<std::uint32_t>{1, 4, 16, 64},
                                         [](Accuracy& accuracy, std::uint32_t value) { accuracy.samples = value; }));
}

TEST(AccuracyTargetError, BoundsTheErrorAndAddsRays) {
  const std::vector<double> targets{8, 4, 2, 1, 0.5};
  const auto points = curve(still_life(), converged_still_life(), targets, [](Accuracy& accuracy, double value) {
    accuracy.adaptive.emplace().target_error = value;
    accuracy.cutoff_by_chance = true;
  });
  expect_less_error_with_more_rays(points);
  for (std::size_t i = 0; i < targets.size(); ++i) EXPECT_LE(points[i].error, targets[i]);
}

TEST(AccuracyMaxDepth, ReducesTheErrorAndAddsRays) {
  expect_less_error_with_more_rays(curve(corridor(), converged(corridor()),
                                         std::vector<std::uint32_t>{0, 1, 2, 4, 8, 16, 32},
                                         [](Accuracy& accuracy, std::uint32_t value) { accuracy.max_depth = value; }));
}

TEST(AccuracyCutoff, ReducesTheErrorAndAddsRaysAsItDecreases) {
  expect_less_error_with_more_rays(curve(corridor(), converged(corridor()),
                                         std::vector<double>{0.9, 0.5, 0.25, 0.1, 0.03},
                                         [](Accuracy& accuracy, double value) { accuracy.cutoff = value; }));
}

TEST(AreaLight, HasAtLeast16ShadowRaysPerPixel) {
  Scene scene = scenes::empty(24);
  scene.camera = {{0, 4, 4}, {0, 0, 0}, {0, 1, 0}, 30};
  Light lamp;
  lamp.source = RectLight{{-2, 3, -2}, {4, 0, 0}, {0, 0, 4}};
  scene.lights = {lamp};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.8, 0.8}));
  scenes::add(scene, Sphere{{0, 0.8, 0}, 0.5}, scenes::matte({0.8, 0.8, 0.8}));
  const std::vector<std::uint32_t> samples{1, 4, 16, 64};
  const auto points = curve(scene, converged(scene), samples,
                            [](Accuracy& accuracy, std::uint32_t value) { accuracy.samples = value; });
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_LT(points[i].error, points[i - 1].error) << samples[i];
  const auto shadow_rays_of = [&](std::size_t i) { return static_cast<double>(points[i].rays.shadow) / (24 * 24); };
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_NEAR(shadow_rays_of(i), 16, 1) << samples[i];
  EXPECT_NEAR(shadow_rays_of(3), 64, 4);
}

/// The samples suffice for the noise to be smaller than the error of each approximation.
TEST(AccuracyApproximate, TakesFewerRaysAndAddsError) {
  Scene scene = still_life();
  scene.accuracy.samples = 64;
  const Point exact = measured(scenes::render(scene, 2), converged_still_life());
  const auto with = [&](const Approximations& approximations) {
    const Point cheap = measured(scenes::approximated(scene, approximations), converged_still_life());
    EXPECT_GT(cheap.error, 1.5 * exact.error);
    return cheap;
  };
  using Shadows = Approximations::Shadows;
  using Reflections = Approximations::Reflections;
  using Shading = Approximations::Shading;
  const Point map = with({.shadows = Shadows::map}), none = with({.shadows = Shadows::none});
  EXPECT_LT(map.error, none.error);
  Point fewer = exact;
  for (const std::uint32_t lights : {5u, 3u, 1u}) {
    const Point fewest = with({.nearest_lights = lights});
    EXPECT_LT(fewest.rays.shadow, fewer.rays.shadow) << lights;
    EXPECT_GT(fewest.error, fewer.error) << lights;
    fewer = fewest;
  }
  for (const Point& cheap :
       {map, none, fewer, with({.reflections = Reflections::none}), with({.reflections = Reflections::environment})})
    EXPECT_LT(cheap.rays.total(), exact.rays.total());
  for (const auto shading : {Shading::gouraud, Shading::flat})
    EXPECT_EQ(with({.shading = shading}).rays.camera, exact.rays.camera);
}

}  // namespace
