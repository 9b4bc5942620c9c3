/// tracer::validate on scenes that programs construct without the reader; tests/reader/invalid has the others.

#include "tracer/validate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using namespace tracer;
using Lines = std::vector<std::string>;

constexpr double infinity = std::numeric_limits<double>::infinity();
const double nan = std::nan("");

Scene valid_scene() {
  Scene scene;
  scene.camera.position = {0, 0, 5};
  scene.materials.push_back({});
  scene.materials[0].path = "/materials/m";
  scene.objects.push_back({Sphere{}, {0}, {}});
  return scene;
}

Lines issues_of(const Scene& scene, const std::function<bool(const Issue&)>& known = {}) {
  return reader_tests::issue_lines(validate(scene, {}, known));
}

TEST(Validate, AcceptsAValidScene) { EXPECT_EQ(issues_of(valid_scene()), Lines{}); }

TEST(Validate, RejectsInvalidHandles) {
  Scene scene = valid_scene();
  scene.objects[0].material = {1};
  scene.materials[0].color = TextureId{0};
  EXPECT_EQ(issues_of(scene), (Lines{"/materials/m/color unknown_reference", "/objects/0/material unknown_reference"}));
}

TEST(Validate, AcceptsSliversOfMeshesButRejectsBadIndices) {
  Scene scene = valid_scene();
  scene.objects[0].shape = Mesh{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {1, 1, 1}}, {}, {}, false};
  EXPECT_EQ(issues_of(scene), Lines{});
  std::get<Mesh>(scene.objects[0].shape).triangles.push_back({0, 3, 4294967295u});
  EXPECT_EQ(issues_of(scene),
            (Lines{"/objects/0/triangles/2/1 out_of_range", "/objects/0/triangles/2/2 out_of_range"}));
}

TEST(Validate, RejectsSingularProductsOfTransforms) {
  // z squashed, then turned by 45 degrees into y, and again.
  const auto squashed = [](double s) {
    const double h = std::sqrt(0.5);
    return Transform{{{{1, 0, 0, 0}, {0, h, -h * s, 0}, {0, h, h * s, 0}}}};
  };
  const auto issues_of_nested = [&](double s) {
    Scene scene = valid_scene();
    scene.prototypes.push_back({.objects = {{Sphere{}, {0}, squashed(s)}}, .path = "/prototypes/thin"});
    scene.objects.push_back({Instance{{0}, {}}, {}, squashed(s)});
    return issues_of(scene);
  };
  for (const double s : {1.0, 1e-4, 1e-8, 1e-13}) EXPECT_EQ(issues_of_nested(s), Lines{}) << s;
  for (const double s : {1e-15, 1e-20}) EXPECT_EQ(issues_of_nested(s), Lines{"/objects/1 degenerate"}) << s;
}

TEST(Validate, RejectsImpossibleImages) {
  Scene scene = valid_scene();
  scene.image = {0, 0};
  scene.accuracy.samples = 0;
  scene.output.formats = {};
  EXPECT_EQ(issues_of(scene), (Lines{"/image/width out_of_range", "/image/height out_of_range",
                                     "/accuracy/samples out_of_range", "/output/formats wrong_length"}));
}

TEST(Validate, RejectsImpossibleAccuracies) {
  Scene scene = valid_scene();
  scene.accuracy.samples = 0;  // ignored where samples adapt
  scene.accuracy.adaptive = Adaptive{1, 1, 1, 1, 1};
  EXPECT_EQ(issues_of(scene), Lines{});
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    const std::string code = std::isfinite(bad) ? " out_of_range" : " not_finite";
    scene.accuracy.adaptive = Adaptive{bad, bad, bad, 1, 1};
    EXPECT_EQ(issues_of(scene), (Lines{"/accuracy/target_error" + code, "/accuracy/tile_error" + code,
                                       "/accuracy/time_budget_ms" + code}));
  }
  scene.accuracy.adaptive = Adaptive{{}, {}, {}, 0, 1};
  EXPECT_EQ(issues_of(scene), Lines{"/accuracy/samples out_of_range"});
  scene.accuracy.adaptive = Adaptive{{}, {}, {}, 2, 1};
  EXPECT_EQ(issues_of(scene), Lines{"/accuracy/samples out_of_range"});
  scene.accuracy.adaptive.reset();
  scene.accuracy.samples = 1;
  scene.accuracy.target_error = scene.accuracy.tile_error = 256;
  scene.accuracy.approximate.nearest_lights = nearest_lights_max + 1;
  EXPECT_EQ(issues_of(scene), (Lines{"/accuracy/target_error out_of_range", "/accuracy/tile_error out_of_range",
                                     "/accuracy/approximate/lights out_of_range"}));
}

TEST(Validate, OmitsIssuesThatTheCallerExcludes) {
  Scene scene = valid_scene();
  scene.camera.fov_deg = nan;
  scene.ambient.r = -1;
  EXPECT_EQ(issues_of(scene, [](const Issue& issue) { return issue.pointer == "/camera/fov"; }),
            Lines{"/ambient out_of_range"});
}

TEST(Validate, CountsOmittedIssues) {
  Scene scene = valid_scene();
  scene.lights.assign(1200, Light{PointLight{}, {}, -1, true, {}});
  const auto issues = validate(scene, {});
  ASSERT_EQ(issues.size(), 1001u);
  EXPECT_EQ(issues.back(), (Issue{"", "too_many_issues", "and 200 more"}));
}

}  // namespace
