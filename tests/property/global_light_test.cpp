// The rendering equation by path tracing, against closed forms. Each mean is of independent renders with fixed seeds:
// it must agree within four of its standard errors and within half a percent.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/global_radiance.h"
#include "tracer/encode.h"

namespace tracer {
namespace {

/// Parallel to z = 0, in the given number of triangles along x and y.
Mesh square(double low, double high, double z, std::uint32_t parts = 1) {
  Mesh mesh;
  const std::uint32_t row = parts + 1;
  for (std::uint32_t y = 0; y <= parts; ++y)
    for (std::uint32_t x = 0; x <= parts; ++x)
      mesh.positions.push_back({low + (high - low) * x / parts, low + (high - low) * y / parts, z});
  for (std::uint32_t y = 0; y < parts; ++y)
    for (std::uint32_t x = 0; x < parts; ++x) {
      const std::uint32_t a = y * row + x;
      mesh.triangles.push_back({a, a + 1, a + row + 1});
      mesh.triangles.push_back({a, a + row + 1, a + row});
    }
  return mesh;
}

TEST(GlobalLight, IsEquallyBrightEverywhereInAnIntegratingSphere) {
  constexpr double rho = 0.6, intensity = 2, radius = 1.5;
  for (const Vec3& position :
       {Vec3{0, 0, 0}, Vec3{0.5, 0, 0}, Vec3{0, -0.7, 0.2}, Vec3{-0.6, 0.6, 0.6}, Vec3{0, 0, 1}}) {
    Scene scene = view_of({0.3, 1, 0.2}, {0, 0, 0}, 1024);
    scenes::add(scene, Sphere{{0, 0, 0}, radius}, surface(rho));
    scene.lights.push_back(scenes::point_light(position, {intensity, intensity, intensity}));
    scene.lights.back().attenuation.kind = Attenuation::Kind::inverse_square;
    const auto indirect = [](Scene one) {
      const double all = mean_radiance(scenes::render(one).image);
      one.accuracy.model = Accuracy::Model::whitted;
      return all - mean_radiance(scenes::render(one).image);
    };
    expect_mean(mean_over_seeds(scene, indirect), rho * rho * intensity / (radius * radius * (1 - rho)),
                "light at " + std::to_string(position.x));
  }
}

TEST(GlobalLight, BetweenInfinitePlanesIsThatOfTheSeries) {
  for (const bool first : {true, false}) {
    Scene scene = view_of({0.1, 0, first ? 0.0 : 1.0}, {0, 0, 0.5}, 512);
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.5, 1));
    scenes::add(scene, Plane{{0, 0, 1}, {0, 0, 1}, {}}, surface(0.8));
    EXPECT_FALSE(requirements(scene).emitters) << "planes are found by hits alone";
    expect_mean(radiance(scene), first ? 1 / 0.6 : 0.8 / 0.6, first ? "glowing plane" : "other plane");
  }
}

enum class Window { lamp, sky, environment };
using Interreflection = Approximations::Interreflection;

/// The floor of a round room with a lamp in the hole in its ceiling, or a sky behind it.
Mean under(Window window, Interreflection by) {
  const Color light{3, 2, 1};
  Scene scene = view_of({-1, 1, 0}, {1, -1, 1.5}, 64);
  scene.accuracy.approximate.interreflection = by;
  scenes::add(scene, Cylinder{{0, 0, 0}, {0, 0, 3}, 2, false, {}}, surface(0.6));
  for (const double z : {0.0, 3.0})
    scenes::add(scene, Disc{{0, 0, z}, {0, 0, 1}, 2, z == 0 ? 0 : 0.8, {}}, surface(0.6));
  if (window == Window::lamp) scenes::add(scene, Disc{{0, 0, 3}, {0, 0, 1}, 0.8, 0, {}}, scenes::glowing(light));
  if (window == Window::sky) scene.background.color = light;
  if (window == Window::environment) {
    scene.textures = {Texture{CheckerTexture{{light, light}}, {8, 6}, {}, "/background/environment"}};
    scene.background.environment = Environment{{}, 1};
  }
  return radiance(scene);
}

TEST(GlobalLight, OfASkyBehindAWindowIsThatOfALampOfItsSize) {
  const Mean lamp = under(Window::lamp, Interreflection::exact);
  for (const Window window : {Window::sky, Window::environment}) {
    const Mean sky = under(window, Interreflection::exact);
    EXPECT_NEAR(sky.value, lamp.value, 4 * std::hypot(sky.error, lamp.error));
    EXPECT_LT(sky.error, 2 * lamp.error) << "and takes about as many samples";
    for (const Interreflection by : {Interreflection::radiosity, Interreflection::gather})
      EXPECT_NEAR(under(window, by).value, lamp.value, 0.01 * lamp.value) << "of patches without it";
  }
}

TEST(GlobalLight, OfAGlowingSphereOverAPlaneHasAClosedForm) {
  constexpr double r = 0.5, h = 1.2, rho = 0.8, glow = 5;
  for (const double aside : {0.0, 1.0, 3.0}) {
    for (const bool ellipsoid : {false, true}) {
      Scene scene = view_of({aside, 0, 0}, {aside, -8, 1}, 512);
      scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(rho));
      scenes::add(scene, Sphere{{0, 0, ellipsoid ? 0 : h}, ellipsoid ? 1 : r}, scenes::glowing({glow, glow, glow}));
      if (ellipsoid)  // turned by a right angle and scaled: it is intersected as a quadric
        scene.objects.back().transform = Transform{{{{0, -r, 0, 0}, {r, 0, 0, 0}, {0, 0, r, h}}}};
      const double distance = std::hypot(aside, h);
      expect_mean(radiance(scene), rho * glow * r * r * h / (distance * distance * distance),
                  std::to_string(aside) + " aside");
    }
  }
}

/// Scenes in which a ground of rho 0.8 is lit by something above it that glows with 5.
Scene under(const Shape& lamp) {
  Scene scene = view_of({0, 0, 0}, {0, -8, 1}, 512);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.8));
  scenes::add(scene, lamp, scenes::glowing({5, 5, 5}));
  return scene;
}
constexpr double square_factor = 0.554126;  ///< 2 x 2, seen from 1 under its middle

TEST(GlobalLight, OfGlowingFlatShapesHasAClosedForm) {
  expect_mean(radiance(under(square(-1, 1, 1))), square_factor * 4, "square of two triangles");
  expect_mean(radiance(under(square(-1, 1, 1, 71))), square_factor * 4, "square of 10,082 triangles");
  expect_mean(radiance(under(Disc{{0, 0, 1}, {0, 0, 1}, 0.7, 0, {}})), 4 * 0.49 / 1.49, "disc");
  const double quarter = (1 / std::sqrt(2.0)) * std::atan(1 / std::sqrt(2.0)) / pi;  // over a corner, by triangles
  Scene triangle = under(Triangle{{{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}}, {}, {}});
  expect_mean(radiance(triangle), quarter / 2 * 4, "half of a square over its corner");
  expect_mean(radiance(under(Box{{-1, -1, 1}, {1, 1, 1.5}})), square_factor * 4, "box");
}

TEST(GlobalLight, OfAnInstanceIsThatOfItsPlace) {
  Scene scene = under(square(-1, 1, 1));
  Object lamp = std::move(scene.objects.back());
  scene.objects.pop_back();
  scene.prototypes.push_back({{std::move(lamp)}, "/prototypes/lamp"});
  scene.objects.push_back({Instance{{0}, {}}, {}, Transform{{{{0, -3, 0, 0}, {3, 0, 0, 0}, {0, 0, 3, 0}}}}});
  expect_mean(radiance(scene), square_factor * 4, "instance, three times as large and as far");
}

TEST(GlobalLight, BehindAFilterCountsOnce) {
  Scene scene = under(square(-1, 1, 1));
  Material filter = surface(0);
  filter.transparency = Material::Transparency::filtered;
  filter.transmission = 0.5;
  scenes::add(scene, Plane{{0, 0, 0.4}, {0, 0, 1}, {}}, filter);
  scene.camera.position = {0, -0.3, 0.1};
  scene.camera.fov_deg = 1;
  scene.accuracy.samples = 4096;
  expect_mean(radiance(scene), square_factor * 4 / 2, "square behind a filter");
}

TEST(GlobalLight, ComesThroughALeafFromItsOtherSide) {
  Material leaf = surface(0.3);
  leaf.diffuse_transmission = 0.4;
  Scene alone = view_of({0, 0, 0}, {3, -3, 3}, 256);
  alone.background.color = {2, 2, 2};
  scenes::add(alone, square(-1, 1, 0), leaf);
  expect_mean(radiance(alone), (0.3 + 0.4) * 2, "leaf in the sky");
  // Seen from below: the lamp is on the other side.
  Scene scene = under(square(-1, 1, 1));
  scene.materials[0] = leaf;
  scene.camera.position = {0, -8, -1};
  expect_mean(radiance(scene), square_factor * 5 * 0.4, "lamp behind a leaf");
}

/// Two squares of different areas and reflectances before the walls of a closed room, behind each other's shadow: a
/// ball is between them. Only the given one glows, and the image is the whole of the other one, from straight before
/// it.
Scene room_of_two_squares(bool first_glows) {
  constexpr double gap = 1e-4, half[] = {0.3, 0.2}, rho[] = {0.3, 0.7};
  Scene scene = view_of({}, {}, 1024);
  scenes::add(scene, Box{{-1, -1, -1}, {1, 1, 1}}, surface(0.6));
  scenes::add(scene, Sphere{{0.2, 0.1, -0.3}, 0.4}, surface(0.4));
  scenes::add(scene, square(-half[0], half[0], gap - 1), surface(rho[0], first_glows ? 1 : 0));
  scenes::add(scene, square(-half[1], half[1], 0), surface(rho[1], first_glows ? 0 : 1));
  scene.objects.back().transform = Transform{{{{0, 0, 1, 1 - gap}, {1, 0, 0, 0.3}, {0, 1, 0, 0.2}}}};
  scene.camera = first_glows ? scenes::orthographic({0.9, 0.3, 0.2}, {1, 0.3, 0.2}, 2 * half[1], {0, 0, 1})
                             : scenes::orthographic({0, 0, -0.9}, {0, 0, -1}, 2 * half[0]);
  return scene;
}

TEST(GlobalLight, FromASmallSquareToAnotherIsThatOfTheWayBack) {
  // With E on one of two diffuse surfaces i and j alone, A_i B_i / rho_i = A_j B_j / rho_j: the transport of radiosity
  // is symmetric after division by the reflectance (A_i F_ij = A_j F_ji, in every power of the transport).
  const Mean second = radiance(room_of_two_squares(true)), first = radiance(room_of_two_squares(false));
  const double there = second.value * 0.2 * 0.2 / 0.7, back = first.value * 0.3 * 0.3 / 0.3;
  const double error = std::hypot(second.error * 0.2 * 0.2 / 0.7, first.error * 0.3 * 0.3 / 0.3);
  EXPECT_LE(error, 0.005 * there);
  EXPECT_LE(std::abs(there - back), 4 * error) << there << " and " << back << " +- " << error;
}

TEST(GlobalLight, OfLightsEmissionAndSkyIsTheirSum) {
  Scene scene = view_of({0.3, 0, 0}, {0, -4, 2}, 1024);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.6));
  scenes::add(scene, Sphere{{1, 0.5, 0.6}, 0.6}, surface(0.5, 2));
  scene.background.color = {0.4, 0.4, 0.4};
  scene.lights.push_back(scenes::point_light({-1, -1, 3}));
  const auto difference = [](const Scene& all) {
    double rest = mean_radiance(scenes::render(all).image);
    for (int part = 0; part < 3; ++part) {
      Scene one = all;
      one.accuracy.seed += 1000 * static_cast<std::uint64_t>(part + 1);
      if (part != 0) one.lights.clear();
      if (part != 1) one.materials[1].emission = Color{};
      if (part != 2) one.background.color = {};
      rest -= mean_radiance(scenes::render(one).image);
    }
    return rest;
  };
  const Mean found = mean_over_seeds(scene, difference);
  EXPECT_LE(std::abs(found.value), 4 * found.error) << found.value << " +- " << found.error;
}

TEST(GlobalLight, OfASmallEmitterHasATenthOfTheVarianceOfHitsAlone) {
  Scene scene = under(Sphere{{0, 0, 1.2}, 0.05});
  scene.accuracy.samples = 1;
  constexpr double factor = 0.05 * 0.05 / (1.2 * 1.2), of_hits = 16 * factor * (1 - factor);
  constexpr std::uint64_t seeds = 400, pixels = 4;
  const double error = radiance(scene, seeds).error;
  EXPECT_LT(error * error * (seeds - 1) * pixels, of_hits / 10);
}

/// A closed box of side 4 that emits what it absorbs, with every kind of surface in it: the radiance is 1 everywhere.
Scene furnace() {
  Scene scene = scenes::empty(16, {{0, -1.9, 0.3}, {0, 0, 0}, {0, 0, 1}, 80});
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.samples = 16;
  scenes::end_by_chance(scene);
  const MaterialId wall = scenes::add(scene, surface(0.7, 0.3)), ball = scenes::add(scene, surface(0.4, 0.6));
  scenes::add(scene, Box{{-2, -2, -2}, {2, 2, 2}}, wall);
  scenes::add(scene, Sphere{{-1, 0, 1}, 0.4}, ball);
  scenes::add(scene, Cylinder{{-0.2, 0, 0.8}, {-0.2, 0, 1.4}, 0.3, true, {}}, ball);
  scenes::add(scene, tracer::Cone{{0.8, 0, 0.7}, {0.8, 0, 1.4}, 0.4, 0, true, {}}, ball);
  scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.4, {-1.2, 0, 0}), ball);
  Material corners = surface(0.5, 0.5);
  corners.shading = Material::Shading::gouraud;
  scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.4, {1.2, 0, 0}), corners);
  Material mirror = surface(0.3, 0.2);
  mirror.reflection = 0.5;
  scenes::add(scene, Sphere{{-0.2, 0, -0.2}, 0.45}, mirror);
  scenes::add(scene, Sphere{{-1, 0, -1.2}, 0.4}, scenes::glass(1.5));
  Material leaf = surface(0.3, 0.2);
  leaf.diffuse_transmission = 0.5;
  scenes::add(scene, Disc{{1, 0.3, 1.3}, {0.3, -1, 0.2}, 0.6, 0, {}}, leaf);
  scene.textures.emplace_back().pattern = CheckerTexture{{Color{0.2, 0.4, 0.9}, Color{0.8, 0.1, 0.5}}};
  scene.textures.emplace_back().pattern = CheckerTexture{{Color{0.8, 0.6, 0.1}, Color{0.2, 0.9, 0.5}}};
  for (Texture& texture : scene.textures) texture.scale = {7, 7};
  Material checker = surface(1);
  checker.color = TextureId{0};
  checker.emission = TextureId{1};
  scenes::add(scene, Sphere{{0.2, 0, -1.2}, 0.5}, checker);
  scene.prototypes.push_back({{{Disc{{0, 0, 0}, {0, 0, 1}, 1, 0, {}}, ball, {}}}, "/prototypes/disc"});
  scene.objects.push_back({Instance{{0}, {}}, {}, Transform{{{{0.5, 0, 0, 1.2}, {0, 0, 0.4, 0}, {0, 0.3, 0, -1.1}}}}});
  return scene;
}

TEST(GlobalLight, IsOneInAFurnaceOfAllShapesAndMaterials) {
  Scene scene = furnace();
  constexpr std::uint64_t seeds = 24;
  std::vector<double> sum, squares;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    scene.accuracy.seed = seed;
    const Image image = scenes::render(scene).image;
    sum.resize(image.rgb.size());
    squares.resize(image.rgb.size());
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
      sum[i] += image.rgb[i];
      squares[i] += double{image.rgb[i]} * image.rgb[i];
    }
  }
  double all = 0, variance = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double mean = sum[i] / seeds, of_mean = (squares[i] / seeds - mean * mean) / (seeds - 1);
    all += mean;
    variance += of_mean;
    // Student's t of 23 degrees of freedom exceeds 6.6 once in a million.
    EXPECT_LE(std::abs(mean - 1), 6.6 * std::sqrt(of_mean) + 1e-6) << "pixel " << i / 3 << ", channel " << i % 3;
  }
  const double count = static_cast<double>(sum.size());
  expect_mean({all / count, std::sqrt(3 * variance) / count}, 1, "whole image");  // channels share their paths
}

TEST(GlobalLight, LeavesOutTheAmbientTermAndIsOffByDefault) {
  Scene scene = under(Sphere{{0, 0, 1.2}, 0.5});
  const std::vector<float> without = scenes::render(scene).image.rgb;
  scene.ambient = {1, 1, 1};
  scene.materials[0].ambient = 1;
  EXPECT_EQ(scenes::render(scene).image.rgb, without);
  scene.accuracy.model = Accuracy::Model::whitted;
  const Rendered whitted = scenes::render(scene);
  EXPECT_EQ(whitted.statistics.rays.diffuse, 0u);
  EXPECT_EQ(whitted.image.rgb[0], 1) << "the ambient term alone";
}

TEST(GlobalLight, ChargesWhatADepthLeavesOut) {
  Scene scene = view_of({1, 0, 0}, {0, 0, 0}, 256);
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, surface(0.5, 0.2));
  scene.accuracy.max_depth = 2;
  const Rendered rendered = scenes::render(scene);
  EXPECT_GT(rendered.statistics.truncated_branches, 0u);
  EXPECT_TRUE(rendered.error.bounded);
  const double truth = 0.4, cut = mean_radiance(rendered.image);
  EXPECT_NEAR(cut, truth * (1 - 0.125), 0.01);
  EXPECT_GT(rendered.error.estimate, 0);
  scene.materials[0].diffuse = 1;
  EXPECT_FALSE(scenes::render(scene).error.bounded) << "light that no surface absorbs has no bound";
}

TEST(GlobalLight, ReachesATargetErrorThatIsTrue) {
  Scene scene = scenes::empty(24, {{0, -1.9, 0.3}, {0, 0, 0}, {0, 0, 1}, 80});
  scene.accuracy = {};
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.adaptive.emplace().target_error = 3;
  scenes::add(scene, Box{{-2, -2, -2}, {2, 2, 2}}, surface(0.6));
  scenes::add(scene, Box{{-1, -0.5, 1.9}, {1, 1.5, 1.95}}, scenes::glowing({3, 3, 3}));
  scenes::add(scene, Sphere{{0.5, 0.5, -1.2}, 0.8}, surface(0.7));
  const Rendered rendered = scenes::render(scene);
  EXPECT_TRUE(rendered.error.target_met);
  Scene reference = scene;
  reference.accuracy.adaptive.reset();
  reference.accuracy.samples = 4096;
  reference.accuracy.seed = 7;
  const double error = compare(to_display(scenes::render(reference).image), to_display(rendered.image))->rmse;
  EXPECT_LE(error, rendered.error.estimate);
  EXPECT_GE(error, 0.3 * rendered.error.estimate);
}

TEST(GlobalLight, OfTheSkyIsThePartThatIsInSight) {
  constexpr double rho = 0.7, sky = 3;
  for (const bool wall : {false, true}) {
    Scene scene = view_of({0.5, 0, 0}, {3, -3, 3}, 512);
    scene.background.color = {sky, sky, sky};
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(rho));
    if (wall) scenes::add(scene, Plane{{0, 0, 0}, {1, 0, 0}, {}}, surface(0));
    expect_mean(radiance(scene), rho * sky / (wall ? 2 : 1), wall ? "beside a black wall" : "open");
  }
  Scene body = view_of({0, 0, 0}, {3, -3, 3}, 64);
  body.background.color = {sky, sky, sky};
  scenes::add(body, Sphere{{0, 0, 0}, 1}, surface(rho));
  expect_mean(radiance(body), rho * sky, "sphere");
}

TEST(GlobalLight, OfASkyWithASunHasItsIrradianceAndASmallVariance) {
  constexpr std::uint32_t columns = 256, rows = 128, row = 20, column = 40;
  constexpr float sun = 20'000;
  Image sky{columns, rows, {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    const float of_sky = i < columns * rows / 2 ? 1 : 0;
    sky.rgb.insert(sky.rgb.end(), 3, i == row * columns + column ? sun : of_sky);
  }
  const Assets assets{{encode(sky, Format::exr)->bytes}};
  Scene scene = view_of({0, 0, 0}, {0, -8, 1}, 64);
  scene.background.up = {0, 0, 1};
  scene.camera.up = {0, 0, 1};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.8));
  scene.textures = {{.pattern = ImageTexture{}, .path = "/background/environment", .filter = Texture::Filter::nearest}};
  scene.assets = {{"sky.exr", "/background/environment/file"}};
  scene.background.environment = Environment{};
  const auto squared_sine = [](double v) { return std::pow(std::sin(pi * (0.5 - v / rows)), 2); };
  // Over pi: half of the difference of the squared sines of the latitudes, for the part of a turn.
  const double of_sun = (sun - 1) * (squared_sine(row) - squared_sine(row + 1.0)) / columns;
  const Mean found = radiance(scene, 24, assets);
  expect_mean(found, 0.8 * (1 + of_sun), "sun");
  EXPECT_GT(of_sun, 1) << "the sun is brighter than the sky";
  EXPECT_LT(found.error * std::sqrt(24 * 4 * 64), 1.5) << "of a sample; hits alone: " << std::sqrt(sun * of_sun);
  for (const auto filter : {Texture::Filter::bilinear, Texture::Filter::mipmap}) {  // both widen the sun
    scene.textures[0].filter = filter;
    const Mean widened = radiance(scene, 24, assets);
    EXPECT_NEAR(widened.value, found.value, 4 * std::hypot(widened.error, found.error) + 0.002 * found.value);
    EXPECT_LT(widened.error * std::sqrt(24 * 4 * 64), 3);
  }
}

TEST(GlobalLight, HoldsImageFilesToTheirBrightestTexel) {
  Scene scene = view_of({0, 0, 0}, {0, -8, 1}, 8);
  scene.camera.up = {0, 0, 1};
  Material glazed = surface(1);
  glazed.reflection = 0.25;
  glazed.color = TextureId{0};
  glazed.path = "/materials/glazed";
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, glazed);
  scene.textures.emplace_back().pattern = ImageTexture{};
  scene.assets = {{"tiles.exr", "/textures/tiles/file"}};
  for (const float brightest : {0.7f, 0.8f}) {
    const Image tiles{2, 1, {0.1f, 0.1f, 0.1f, 0.1f, brightest, 0.1f}};
    RenderControl control;
    const auto compiled = compile(scene, control, Assets{{encode(tiles, Format::exr)->bytes}});
    ASSERT_EQ(bool(compiled), brightest < 0.75f);
    if (compiled) continue;
    EXPECT_EQ(compiled.error().code, Failure::Code::bad_asset);
    EXPECT_EQ(compiled.error().pointer, "/materials/glazed");
  }
}

}  // namespace
}  // namespace tracer
