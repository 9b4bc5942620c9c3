/// tracer::validate on scenes that programs construct without the reader.

#include "tracer/validate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

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
  Lines lines;
  for (const Issue& issue : validate(scene, {}, known)) lines.push_back(issue.pointer + " " + issue.code);
  return lines;
}

Lines issues_with_shape(const Shape& shape) {
  Scene scene = valid_scene();
  scene.objects[0].shape = shape;
  return issues_of(scene);
}

TEST(Validate, AcceptsAValidScene) { EXPECT_EQ(issues_of(valid_scene()), Lines{}); }

TEST(Validate, RejectsInvalidHandles) {
  Scene scene = valid_scene();
  scene.objects[0].material = {1};
  scene.materials[0].color = TextureId{0};
  EXPECT_EQ(issues_of(scene), (Lines{"/materials/m/color unknown_reference", "/objects/0/material unknown_reference"}));
}

TEST(Validate, AcceptsCoordinatesUpToTheLimit) {
  const double largest = Limits{}.coordinate_max;
  EXPECT_EQ(issues_with_shape(Sphere{{largest, -largest, 0}, largest}), Lines{});
  const double beyond = std::nextafter(largest, infinity);
  EXPECT_EQ(issues_with_shape(Sphere{{beyond, 0, 0}, beyond}),
            (Lines{"/objects/0/center/0 limit_exceeded", "/objects/0/radius limit_exceeded"}));
  EXPECT_EQ(issues_with_shape(Sphere{{}, std::numeric_limits<double>::denorm_min()}),
            Lines{"/objects/0/radius limit_exceeded"});
}

TEST(Validate, AcceptsDirectionsOfAnyLengthExceptZero) {
  EXPECT_EQ(issues_with_shape(Plane{{}, {0, 1e-59, 1e59}, {}}), Lines{});
  EXPECT_EQ(issues_with_shape(Plane{{}, {0, -1e-60, 0}, {}}), Lines{});
  EXPECT_EQ(issues_with_shape(Plane{{}, {0, -1e-61, 0}, {}}), Lines{"/objects/0/normal degenerate"});
  EXPECT_EQ(issues_with_shape(Plane{{}, {0, 0, 0}, {}}), Lines{"/objects/0/normal degenerate"});
}

TEST(Validate, RejectsParallelAxesAtEveryScale) {
  for (const double scale : {1e-50, 1.0, 1e50}) {
    EXPECT_EQ(issues_with_shape(Plane{{}, {0, 1, 0}, Vec3{0, -scale, 0}}), Lines{"/objects/0/u_axis degenerate"});
    EXPECT_EQ(issues_with_shape(Plane{{}, {1, 2, 3}, Vec3{-scale, -2 * scale, -3 * scale}}),
              Lines{"/objects/0/u_axis degenerate"});
    EXPECT_EQ(issues_with_shape(Plane{{}, {0, 1, 0}, Vec3{scale * 1e-9, scale, 0}}), Lines{});
  }
}

TEST(Validate, RejectsTrianglesWithoutAreaButAcceptsNeedles) {
  const auto triangle = [](Vec3 a, Vec3 b, Vec3 c) { return issues_with_shape(Triangle{{a, b, c}, {}, {}}); };
  EXPECT_EQ(triangle({0, 0, 0}, {1, 0, 0}, {2, 1e-12, 0}), Lines{});
  EXPECT_EQ(triangle({0, 0, 0}, {1e-20, 0, 0}, {0, 1e-20, 0}), Lines{});
  EXPECT_EQ(triangle({1e9, 1e9, 0}, {1e9 + 1, 1e9, 0}, {1e9, 1e9 + 1, 0}), Lines{});
  EXPECT_EQ(triangle({0, 0, 0}, {1, 2, 3}, {-2, -4, -6}), Lines{"/objects/0/vertices degenerate"});
  EXPECT_EQ(triangle({1, 1, 1}, {1, 1, 1}, {2, 3, 4}), Lines{"/objects/0/vertices degenerate"});
}

TEST(Validate, AcceptsSliversOfMeshesButRejectsBadIndices) {
  Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {1, 1, 1}}, {}, {}, false};
  EXPECT_EQ(issues_with_shape(mesh), Lines{});
  mesh.triangles.push_back({0, 3, 4294967295u});
  EXPECT_EQ(issues_with_shape(mesh),
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
