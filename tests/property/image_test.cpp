// Crop, backgrounds, depth cue, alpha and layers, rendered through the public interface.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.h"
#include "tracer/requirements.h"

namespace {

using namespace tracer;

/// A glowing red ball of radius 1 four units in front of the camera, over black.
Scene ball_scene() {
  Scene scene = scenes::empty(41, {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40});
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::glowing({1, 0.5, 0.25}));
  return scene;
}

Color middle(const Scene& scene) {
  const Image image = scenes::render(scene).image;
  const float* pixel = image.pixel(image.width / 2, image.height / 2);
  return {pixel[0], pixel[1], pixel[2]};
}

void expect_near(const Color& seen, const Color& expected) {
  EXPECT_NEAR(seen.r, expected.r, 1e-6);
  EXPECT_NEAR(seen.g, expected.g, 1e-6);
  EXPECT_NEAR(seen.b, expected.b, 1e-6);
}

TEST(Crop, IsBitIdenticalToThatWindowOfTheFullImage) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Scene scene = scenes::random(seed, 70);
    scene.accuracy.samples = 5;
    scene.camera.aperture = 0.1;
    const Image full = scenes::render(scene).image;
    for (const PixelWindow crop : {PixelWindow{13, 7, 50, 61}, PixelWindow{69, 0, 70, 70}, PixelWindow{0, 0, 70, 70}}) {
      scene.image.crop = crop;
      const Rendered part = scenes::render(scene);
      ASSERT_EQ(part.image.width, crop.width());
      ASSERT_EQ(part.image.height, crop.height());
      EXPECT_EQ(part.statistics.samples - part.statistics.holdout_samples, 5 * crop.pixels());
      for (std::uint32_t y = 0; y < crop.height(); ++y) {
        const float* row = full.pixel(crop.x0, crop.y0 + y);
        EXPECT_TRUE(std::equal(row, row + std::size_t{3} * crop.width(), part.image.pixel(0, y))) << seed << ' ' << y;
      }
    }
  }
}

TEST(Crop, OfOnePixelHasTheSameSamplesForAnyBatchSize) {
  Scene scene = scenes::random(2, 6);
  scene.accuracy.samples = 700;  // of one pixel at once; of six times six, in several goes
  scene.accuracy.cutoff = 0.05;
  scene.output.layers = {Layer::depth, Layer::albedo, Layer::samples};
  const Image full = scenes::render(scene).image;
  for (std::uint32_t y = 0; y < 6; ++y) {
    for (std::uint32_t x = 0; x < 6; ++x) {
      scene.image.crop = PixelWindow{x, y, x + 1, y + 1};
      const Image alone = scenes::render(scene).image;
      const std::size_t place = 6 * y + x;
      EXPECT_TRUE(std::equal(alone.rgb.begin(), alone.rgb.end(), full.pixel(x, y))) << x << ' ' << y;
      EXPECT_EQ(alone.layers.depth[0], full.layers.depth[place]) << x << ' ' << y;
      EXPECT_EQ(alone.layers.albedo[0], full.layers.albedo[3 * place]) << x << ' ' << y;
      EXPECT_EQ(alone.layers.samples[0], 700u);
      EXPECT_EQ(full.layers.samples[place], 700u) << x << ' ' << y;
    }
  }
}

/// Two meshes of its own, one mirrored and with normals, and one placed twice.
Scene mesh_scene() {
  Scene scene = ball_scene();
  scene.lights.push_back(scenes::point_light({3, 4, 5}));
  scenes::add(scene, scenes::placed(scenes::torus(24, 12), 1, {0, 0, 1}), scenes::matte({0.5, 0.6, 0.7}));
  Mesh with_normals = scenes::icosphere(1);
  with_normals.normals = with_normals.positions;
  scenes::add(scene, std::move(with_normals), scenes::matte({1, 0.5, 0.5}));
  scene.objects.back().transform = Transform{{{{-0.5, 0, 0, 1}, {0, 0.5, 0, 1}, {0, 0, 0.5, 1}}}};
  scene.prototypes.push_back({{{scenes::icosphere(1, true), scene.objects.back().material, {}}}, "/prototypes/it"});
  for (const double x : {-1.0, 0.5})
    scene.objects.push_back({Instance{{0}, {}}, {}, Transform{{{{0.4, 0, 0, x}, {0, 0.4, 0, -1}, {0, 0, 0.4, 1}}}}});
  return scene;
}

TEST(CompileTakingMeshes, GivesTheSameImageAndRemovesTheMeshes) {
  Scene scene = mesh_scene();
  const Rendered copied = scenes::render(scene);
  const Requirements needs = requirements(scene);
  EXPECT_TRUE(needs.smooth_normals);
  RenderControl control;
  const auto compiled = compile_taking_meshes(scene, control);
  ASSERT_TRUE(compiled);
  const auto taken = render(**compiled, {.threads = 1}, control);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->image.rgb, copied.image.rgb);
  EXPECT_EQ(taken->statistics, copied.statistics);
  for (const Object& object : scene.objects) {
    const auto* mesh = std::get_if<Mesh>(&object.shape);
    if (mesh == nullptr) continue;
    EXPECT_TRUE(mesh->positions.empty() && mesh->triangles.empty() && mesh->normals.empty());
  }
  EXPECT_FALSE(std::get<Mesh>(scene.prototypes[0].objects[0].shape).positions.empty());
  EXPECT_EQ(requirements(scene).smooth_normals, needs.smooth_normals);
}

TEST(Aperture, NeedsNoRaysAndChangesNoBitWithOneSample) {
  Scene scene = scenes::random(3, 40);
  const Rendered pinhole = scenes::render(scene);
  EXPECT_FALSE(requirements(scene).lens);
  scene.camera.aperture = 0.5;
  EXPECT_FALSE(requirements(scene).lens) << "the lens's centre is the pinhole";
  EXPECT_EQ(scenes::render(scene).image.rgb, pinhole.image.rgb);
  scene.accuracy.samples = 4;
  EXPECT_TRUE(requirements(scene).lens);
  const Rendered blurred = scenes::render(scene);
  EXPECT_EQ(blurred.statistics.rays.camera, 4 * pinhole.statistics.rays.camera);
  scene.camera.aperture = 0;
  EXPECT_NE(scenes::render(scene).image.rgb, blurred.image.rgb);
}

TEST(Gradient, IsNadirBelowZenithAboveAndTheirMeanAtTheHorizon) {
  Scene scene = scenes::empty(1);
  scene.background.gradient = Gradient{{0.2, 0.4, 1}, {1, 0.5, 0}};
  const auto seen = [&](const Vec3& towards, const Vec3& up) {
    scene.camera = {{1, 2, 3}, {1 + towards.x, 2 + towards.y, 3 + towards.z}, up, 1};
    return middle(scene);
  };
  expect_near(seen({1, 0, 0}, {0, 3, 0}), {0.6, 0.45, 0.5});
  expect_near(seen({0, 0.6, 0.8}, {0, 1, 0}), {1 - 0.8 * 0.8, 0.5 - 0.1 * 0.8, 0.8});  // t = (0.6 + 1) / 2
  expect_near(seen({0, -0.6, 0.8}, {0, 1, 0}), {1 - 0.8 * 0.2, 0.5 - 0.1 * 0.2, 0.2});
  expect_near(seen({0, 0.6, 0.8}, {0, 0, 2}),
              {1 - 0.8 * 0.8, 0.5 - 0.1 * 0.8, 0.8});  // the camera's up is not the sky's
  scene.background.up = {0, 0, 3};
  expect_near(seen({0, 0.6, 0.8}, {0, 1, 0}), {1 - 0.8 * 0.9, 0.5 - 0.1 * 0.9, 0.9});
  scene.background.up.reset();
  expect_near(seen({0, 0.6, 0.8}, {0, 0, 2}), {1 - 0.8 * 0.9, 0.5 - 0.1 * 0.9, 0.9});
}

/// The scene's middle under a cue between `front` and `back`: the ball is hit at z = 4.
Color cued(Scene scene, double front, double back) {
  scene.depth_cue = DepthCue{front, back, 0.75, 0.25, {0, 1, 2}};
  return middle(scene);
}

Color mixed(const Color& color, double scale) {
  return {color.r * scale, color.g * scale + (1 - scale), color.b * scale + 2 * (1 - scale)};
}

TEST(DepthCue, IsConstantOutsideAndLinearBetweenFrontAndBack) {
  const Color red{1, 0.5, 0.25};
  expect_near(cued(ball_scene(), 5, 6), mixed(red, 0.75));
  expect_near(cued(ball_scene(), 4.000001, 6), mixed(red, 0.75));
  expect_near(cued(ball_scene(), 3, 3.5), mixed(red, 0.25));
  expect_near(cued(ball_scene(), 2, 6), mixed(red, 0.5));
  expect_near(cued(ball_scene(), 3, 7), mixed(red, 0.625));
  expect_near(cued(ball_scene(), 5, 5), mixed(red, 0.75));  // a step
  expect_near(cued(ball_scene(), 3, 3), mixed(red, 0.25));
}

TEST(DepthCue, MeasuresAlongTheAxisAndTreatsAMissAsBeyondBack) {
  Scene nothing = scenes::empty(1, ball_scene().camera);
  nothing.background.color = {1, 1, 1};
  expect_near(cued(nothing, 1e9, 2e9), mixed({1, 1, 1}, 0.25));
  // A wall across the axis has one depth, however slanted the ray.
  Scene wall = scenes::empty(9, {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 100});
  scenes::add(wall, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::glowing({1, 1, 1}));
  wall.depth_cue = DepthCue{2, 6, 1, 0, {0, 0, 0}};
  for (const float value : scenes::render(wall).image.rgb) EXPECT_NEAR(value, 0.5, 1e-6);
  wall.camera.type = Camera::Type::panorama;  // along the ray: only the middle is at 4
  EXPECT_LT(scenes::render(wall).image.pixel(5, 4)[0], 0.45);
}

TEST(DepthCue, AppliesToCameraRaysOnly) {
  Scene scene = scenes::empty(1, {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 1});
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::mirror());
  scene.depth_cue = DepthCue{5, 6, 1, 0, {0, 0, 0}};
  expect_near(middle(scene), {1, 1, 1});  // the mirror is before front, what it shows far behind back
}

TEST(Alpha, IsThePartOfThePixelThatHitsAndColourIsPremultipliedByIt) {
  Scene scene = ball_scene();
  scene.background.color = {3, 3, 3};
  scene.accuracy.samples = 16;
  const Image opaque = scenes::render(scene).image;
  EXPECT_TRUE(opaque.alpha.empty());
  scene.output.alpha = true;
  const Image image = scenes::render(scene).image;
  ASSERT_EQ(image.alpha.size(), 41u * 41u);
  bool edge = false;
  for (std::size_t i = 0; i < image.alpha.size(); ++i) {
    EXPECT_NEAR(image.rgb[3 * i + 1], 0.5 * image.alpha[i], 1e-6);
    EXPECT_NEAR(opaque.rgb[3 * i + 1], image.rgb[3 * i + 1] + 3 * (1 - image.alpha[i]), 1e-6);
    edge |= image.alpha[i] > 0 && image.alpha[i] < 1;
  }
  EXPECT_TRUE(edge);
  EXPECT_EQ(image.alpha[0], 0);
  EXPECT_EQ(image.alpha[20 * 41 + 20], 1);
}

TEST(Layers, ContainTheFirstHitsAndOnlyRequestedChannels) {
  Scene scene = ball_scene();
  Material blue = scenes::matte({0.25, 0.5, 0.75});
  scenes::add(scene, Plane{{0, 0, -3}, {0, 0, 2}, {}}, blue);
  scene.camera.look_at = {0, 0, 0};
  const Rendered plain = scenes::render(scene);
  EXPECT_TRUE(plain.image.layers.depth.empty() && plain.image.layers.normal.empty() &&
              plain.image.layers.albedo.empty() && plain.image.layers.object_id.empty() &&
              plain.image.layers.samples.empty());
  scene.output.layers = {Layer::depth, Layer::normal, Layer::albedo, Layer::object_id, Layer::samples};
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.image.rgb, plain.image.rgb);
  EXPECT_EQ(rendered.statistics, plain.statistics);
  const Layers& layers = rendered.image.layers;
  const std::size_t ball = 20 * 41 + 20, wall = 0;
  EXPECT_NEAR(layers.depth[ball], 4, 1e-6);
  EXPECT_NEAR(layers.depth[wall], 8, 1e-6);
  EXPECT_NEAR(layers.normal[3 * ball + 2], 1, 1e-6);
  EXPECT_EQ(layers.normal[3 * wall + 2], 1);
  EXPECT_EQ(layers.albedo[3 * wall + 1], 0.5F);
  EXPECT_EQ(layers.albedo[3 * ball + 1], 0);
  EXPECT_EQ(layers.object_id[ball], 1u);
  EXPECT_EQ(layers.object_id[wall], 2u);
  EXPECT_EQ(layers.samples[wall], 1u);
}

TEST(Layers, AreMeansOverSamplesAndMarkPixelsWithoutAHit) {
  Scene scene = ball_scene();
  scene.accuracy.samples = 16;
  scene.materials[0].color = Color{1, 1, 1};
  scene.output.layers = {Layer::depth, Layer::albedo, Layer::object_id, Layer::samples};
  scene.output.alpha = true;
  const Image image = scenes::render(scene).image;
  for (std::size_t i = 0; i < image.alpha.size(); ++i) {
    EXPECT_EQ(image.layers.samples[i], 16u);
    EXPECT_NEAR(image.layers.albedo[3 * i], image.alpha[i], 1e-6);
    EXPECT_EQ(image.layers.object_id[i], image.alpha[i] > 0 ? 1u : 0u);
    EXPECT_EQ(std::isinf(image.layers.depth[i]), image.alpha[i] == 0);
  }
}

}  // namespace
