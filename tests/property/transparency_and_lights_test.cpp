// One pixel compared with its formula: spot lights, area lights, absorption, and unrefracted transparency.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"

namespace {

using namespace tracer;

constexpr double degree = std::numbers::pi / 180;

/// Radiance at a camera at (0, 0, 5) that looks at 0.
std::array<double, 3> ahead(Scene scene) {
  scene.camera = {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 0.01};
  const Image image = scenes::render(scene).image;
  return {image.rgb[0], image.rgb[1], image.rgb[2]};
}

/// A white wall at z = 0 that the light shines on.
double wall_lit_by(const Light& light, std::uint32_t samples = 1) {
  Scene scene = scenes::empty(1);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::matte({1, 1, 1}));
  scene.lights = {light};
  scene.accuracy.samples = samples;
  return ahead(scene)[0];
}

TEST(SpotLight, IsFullWithinTheInnerAngleNothingBeyondTheOuterAndSmoothBetween) {
  for (const double angle : {0.0, 9.0, 10.0, 12.0, 15.0, 19.9, 20.1, 40.0}) {
    // From (0, 0, 2), aimed so that the wall's origin is off its axis by the angle.
    const SpotLight spot{{0, 0, 2}, {std::sin(angle * degree), 0, -std::cos(angle * degree)}, 10, 20};
    const double x =
        (std::cos(angle * degree) - std::cos(20 * degree)) / (std::cos(10 * degree) - std::cos(20 * degree));
    const double s = std::clamp(x, 0.0, 1.0);
    EXPECT_NEAR(wall_lit_by({spot}), s * s * (3 - 2 * s), 1e-6) << angle;
  }
}

TEST(SoftLights, OfNoSizeArePointLights) {
  const Vec3 at{0.5, 1, 2};
  const double expected = wall_lit_by({PointLight{at}});
  const double e = 1e-9;
  for (const LightSource& source :
       {LightSource{LineLight{at, {0.5 + e, 1, 2}}}, LightSource{RectLight{at, {e, 0, 0}, {0, e, 0}}},
        LightSource{DiscLight{at, {0, 0, 1}, e}}, LightSource{SphereLight{at, e}}})
    EXPECT_NEAR(wall_lit_by({source}), expected, 1e-7) << source.index();
}

/// Midpoint rule over the unit square of a light's parameters, for the cosine at the wall's origin times 1/d^2.
template <class Point>
double mean_over(const Point& point) {
  constexpr int n = 600;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 p = point((i + 0.5) / n, (j + 0.5) / n);
      const double d2 = p.x * p.x + p.y * p.y + p.z * p.z;
      sum += std::max(0.0, p.z) / std::sqrt(d2) / d2;
    }
  return sum / (n * n);
}

TEST(SoftLights, AreTheMeanOverTheirLengthAreaOrSurface) {
  const auto lit = [](const LightSource& source) {
    return wall_lit_by({.source = source, .attenuation = {Attenuation::Kind::inverse_square}}, 4096);
  };
  const Vec3 c{0.3, -0.2, 1.5};
  const auto turn = [](double t) { return 2 * std::numbers::pi * t; };
  EXPECT_NEAR(lit(LineLight{{-1, 0, 1}, {1, 0.5, 2}}), mean_over([](double s, double) {
                return Vec3{-1 + 2 * s, 0.5 * s, 1 + s};
              }),
              2e-4);
  EXPECT_NEAR(lit(RectLight{{-1, -1, 1}, {2, 0, 0.5}, {0, 1.5, 0}}), mean_over([](double s, double t) {
                return Vec3{-1 + 2 * s, -1 + 1.5 * t, 1 + 0.5 * s};
              }),
              1e-3);
  EXPECT_NEAR(lit(DiscLight{c, {0, 0, -1}, 0.8}), mean_over([&](double s, double t) {
                const double r = 0.8 * std::sqrt(s);
                return Vec3{c.x + r * std::cos(turn(t)), c.y + r * std::sin(turn(t)), c.z};
              }),
              1e-3);
  EXPECT_NEAR(lit(SphereLight{c, 0.7}), mean_over([&](double s, double t) {
                const double z = 2 * s - 1, r = 0.7 * std::sqrt(1 - z * z);
                return Vec3{c.x + r * std::cos(turn(t)), c.y + r * std::sin(turn(t)), c.z + 0.7 * z};
              }),
              1e-3);
}

TEST(Hollow, EqualsASphereOfAirOfHigherPriorityAndAMeshTurnedInsideOut) {
  Material wine = scenes::glass(1);
  wine.fresnel = false;
  wine.reflection = 0;
  wine.absorption = {1, 1, 1};
  Scene scene = scenes::empty(1);
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Sphere{{0, 0, 0}, 2}, wine);
  Scene inside_out = scene;
  Material air = wine;
  air.absorption = {};
  air.priority = 1;
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, air);
  EXPECT_NEAR(ahead(scene)[0], std::exp(-2.0), 1e-6);
  Mesh wall = scenes::icosphere(4);
  for (auto& corners : wall.triangles) std::swap(corners[1], corners[2]);
  scenes::add(inside_out, wall, MaterialId{0});
  EXPECT_NEAR(ahead(inside_out)[0], std::exp(-2.0), 2e-3) << "facets lie a little within the ball";
}

TEST(ThinPanes, InterpolateOrFilterTheRadianceBehindThem) {
  Material pane = scenes::matte({0.2, 0.4, 0.8});
  pane.transmission = 0.25;
  pane.emission = Color{0.05, 0, 0};
  pane.transmission_color = Color{0.5, 1, 2};
  Scene scene = scenes::empty(1);
  scene.ambient = {0.5, 0.5, 0.5};
  scene.background.color = {1, 1, 1};
  for (const auto transparency : {Material::Transparency::interpolated, Material::Transparency::filtered}) {
    pane.transparency = transparency;
    Scene through = scene;
    scenes::add(through, Disc{{0, 0, 0}, {0, 0, 1}, 1, 0, {}}, pane);
    const auto seen = ahead(through);
    const bool mixes = transparency == Material::Transparency::interpolated;
    const double own = mixes ? 0.75 : 1;
    EXPECT_NEAR(seen[0], own * 0.1 + 0.05 + 0.125, 1e-6);
    EXPECT_NEAR(seen[1], own * 0.2 + 0.25, 1e-6);
    EXPECT_NEAR(seen[2], own * 0.4 + 0.5, 1e-6);
  }
}

TEST(Instance, IsBitIdenticalToItsFlattenedCopy) {
  Scene flat = scenes::random(5, 32), placed = flat;
  const std::size_t first = flat.objects.size();
  const Transform stretched{{{{1.5, 0.25, 0, 0.5}, {0, 0.75, 0.5, -0.25}, {0.25, 0, -1, 0.125}}}};
  Prototype prototype;
  for (const Shape& shape : {Shape{Sphere{{0, 0, 0}, 1}}, Shape{Cone{{0, 2, 0}, {0, 1, 0}, 0.5, 0.25, true, {}}},
                             Shape{Box{{1, 0, 0}, {2, 1, 1}}}, Shape{scenes::icosphere(1, true)}}) {
    scenes::add(flat, shape, MaterialId{0});
    flat.objects.back().transform = stretched;
    prototype.objects.push_back({shape, MaterialId{0}, {}});
  }
  placed.prototypes.push_back(prototype);
  placed.objects.push_back({Instance{{0}, {}}, {}, stretched});
  ASSERT_EQ(flat.objects.size(), first + 4);
  EXPECT_EQ(scenes::render(placed).image.rgb, scenes::render(flat).image.rgb);
}

/// A floor below a lamp and the camera, which is closer.
TEST(Medium, AbsorbsTheWayFromTheLampAndToTheCamera) {
  Scene scene = scenes::empty(1, scenes::orthographic({0, 2, 0}, {0, 0, 0}, 1e-6, {0, 0, -1}));
  scene.lights = {scenes::point_light({0, 5, 0})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.5, 0.5, 0.5}));
  scene.medium.absorption = {0.1, 0.25, 0};
  const std::vector<float> rgb = scenes::render(scene).image.rgb;
  EXPECT_NEAR(rgb[0], 0.5 * std::exp(-0.1 * 7), 1e-7);
  EXPECT_NEAR(rgb[1], 0.5 * std::exp(-0.25 * 7), 1e-7);
  EXPECT_EQ(rgb[2], 0.5F);
}

TEST(Medium, LetsNoLightArriveFromInfinitelyFar) {
  Scene scene = scenes::empty(2, {{0, 1, 0}, {0, 0.9, -5}, {0, 1, 0}, 60});
  scene.background.color = {1, 1, 1};
  scene.lights = {scenes::directional_light({0, -1, 0})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  scene.medium.absorption = {0.1, 0, 0};
  const Rendered seen = scenes::render(scene);
  for (std::size_t i = 0; i < seen.image.rgb.size(); i += 3) {
    EXPECT_EQ(seen.image.rgb[i], 0);
    EXPECT_GT(seen.image.rgb[i + 1], 0);
  }
}

/// Through a pane of thickness 1 that absorbs otherwise, straight on.
TEST(Medium, EndsAtTheSurfacesOfSolids) {
  Scene scene = scenes::empty(1, {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 1e-3});
  scene.medium.absorption = {0.2, 0.2, 0.2};
  Material pane = scenes::matte({0, 0, 0});
  pane.transmission = 1;
  pane.transparency = Material::Transparency::filtered;
  pane.absorption = {0.5, 0, 1};
  scenes::add(scene, Box{{-1, -1, 0}, {1, 1, 1}}, pane);
  scenes::add(scene, Plane{{0, 0, -2}, {0, 0, 1}, {}}, scenes::glowing({1, 1, 1}));
  const std::vector<float> rgb = scenes::render(scene).image.rgb;
  EXPECT_NEAR(rgb[0], std::exp(-0.2 * 5 - 0.5), 1e-6);
  EXPECT_NEAR(rgb[1], std::exp(-0.2 * 5), 1e-6);
  EXPECT_NEAR(rgb[2], std::exp(-0.2 * 5 - 1), 1e-6);
}

}  // namespace
