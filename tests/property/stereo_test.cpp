/// Stereo pairs: two eyes in one image.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/compare.h"

using namespace tracer;

namespace {

using Layout = Camera::Layout;

constexpr double focus = 6;

/// Balls at, before and behind the plane in focus.
Scene three_balls(std::uint32_t width, std::uint32_t height) {
  Scene scene = scenes::empty(1, {{0, 1, focus}, {0, 1, 0}, {0, 1, 0}, 40});
  scene.image = {width, height};
  scene.background.gradient = Gradient{{0.1, 0.4, 0.9}, {0.8, 0.3, 0.05}};
  scene.lights = {scenes::point_light({2, 6, 5})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.6, 0.7, 0.8}));
  scenes::add(scene, Sphere{{0, 1, 0}, 0.8}, scenes::matte({0.9, 0.4, 0.2}));
  scenes::add(scene, Sphere{{-0.5, 0.6, 2.5}, 0.3}, scenes::mirror(0.8));
  scenes::add(scene, Sphere{{1.5, 0.9, -4}, 0.9}, scenes::glowing({0.2, 0.7, 0.3}));
  return scene;
}

Scene pair(Scene scene, Layout layout, double separation) {
  scene.camera.layout = layout;
  scene.camera.eye_separation = separation;
  if (layout == Layout::side_by_side) scene.image.width *= 2;
  return scene;
}

/// Columns [from, from + width) of the image.
std::vector<float> columns(const Image& image, std::uint32_t from, std::uint32_t width) {
  std::vector<float> part;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = from; x < from + width; ++x)
      part.insert(part.end(), image.pixel(x, y), image.pixel(x, y) + 3);
  return part;
}

TEST(Stereo, WithoutSeparationRepeatsTheImageBitForBit) {
  for (const Camera::Type type : {Camera::Type::perspective, Camera::Type::orthographic}) {
    Scene scene = three_balls(40, 30);
    scene.camera.type = type;
    scene.camera.height = 4;
    const Image single = scenes::render(scene).image;
    const Image both = scenes::render(pair(scene, Layout::side_by_side, 0)).image;
    EXPECT_EQ(columns(both, 0, 40), single.rgb);
    EXPECT_EQ(columns(both, 40, 40), single.rgb);
    EXPECT_EQ(scenes::render(pair(scene, Layout::anaglyph, 0)).image.rgb, single.rgb);
  }
}

/// A camera moved aside, with a wider image of which a part off the middle is cut out.
TEST(Stereo, EqualsTwoCamerasWhoseWindowsAreShifted) {
  constexpr std::uint32_t width = 48, height = 36, shift = 5;
  const double pixel = 2 * std::tan(20 * std::numbers::pi / 180) / height;  // at distance 1
  const double separation = 2 * shift * pixel * focus;
  const Image both = scenes::render(pair(three_balls(width, height), Layout::side_by_side, separation)).image;
  for (const bool right : {false, true}) {
    Scene moved = three_balls(width + 2 * shift, height);
    const double aside = (right ? 0.5 : -0.5) * separation;
    moved.camera.position.x += aside;
    moved.camera.look_at.x += aside;
    const Image wide = scenes::render(moved).image;
    const std::vector<float> expected = columns(wide, right ? 0 : 2 * shift, width);
    const std::vector<float> seen = columns(both, right ? width : 0, width);
    std::size_t different = 0;  // silhouettes are decided by rounding
    for (std::size_t i = 0; i < seen.size(); ++i) different += std::abs(seen[i] - expected[i]) > 1e-5 ? 1 : 0;
    EXPECT_LE(different, 9U) << right;
  }
}

TEST(Stereo, HasNoParallaxAtTheFocusAndOppositeOnesBeforeAndBehindIt) {
  for (const Camera::Type type : {Camera::Type::perspective, Camera::Type::orthographic}) {
    const auto middle_of_ball = [&](double z, bool right) {
      Scene scene = scenes::empty(1, {{0, 0, focus}, {0, 0, 0}, {0, 1, 0}, 40});
      scene.image = {100, 50};
      scene.camera.type = type;
      scene.camera.height = 4;
      scenes::add(scene, Sphere{{0, 0, z}, 0.4}, scenes::glowing({1, 1, 1}));
      const Image image = scenes::render(pair(scene, Layout::side_by_side, 0.3)).image;
      double sum = 0, count = 0;
      for (std::uint32_t x = 0; x < 100; ++x)
        for (std::uint32_t y = 0; y < 50; ++y)
          if (image.pixel(x + (right ? 100 : 0), y)[0] > 0) sum += x, ++count;
      return sum / count;
    };
    EXPECT_NEAR(middle_of_ball(0, true), middle_of_ball(0, false), 0.05);
    EXPECT_LT(middle_of_ball(2, true), middle_of_ball(2, false) - 1);
    EXPECT_GT(middle_of_ball(-4, true), middle_of_ball(-4, false) + 1);
  }
}

TEST(Stereo, AnaglyphHasRedOfTheLeftEyeAndTheRestOfTheRightEye) {
  for (const double aperture : {0.0, 0.2})
    for (const std::uint32_t samples : {1u, 4u}) {
      Scene scene = three_balls(40, 30);
      scene.camera.aperture = aperture;
      scene.accuracy.samples = samples;
      const Rendered anaglyph = scenes::render(pair(scene, Layout::anaglyph, 0.3));
      EXPECT_EQ(anaglyph.statistics.rays.camera, 2 * anaglyph.statistics.samples);
      if (samples > 1) continue;  // samples of other pixels have other positions
      const Image both = scenes::render(pair(scene, Layout::side_by_side, 0.3)).image;
      for (std::uint32_t y = 0; y < 30; ++y)
        for (std::uint32_t x = 0; x < 40; ++x) {
          EXPECT_EQ(anaglyph.image.pixel(x, y)[0], both.pixel(x, y)[0]);
          EXPECT_EQ(anaglyph.image.pixel(x, y)[1], both.pixel(x + 40, y)[1]);
          EXPECT_EQ(anaglyph.image.pixel(x, y)[2], both.pixel(x + 40, y)[2]);
        }
    }
}

TEST(Stereo, ReachesItsTargetError) {
  for (const Layout layout : {Layout::side_by_side, Layout::anaglyph}) {
    Scene scene = pair(three_balls(48, 36), layout, 0.3);
    Scene reference = scene;
    reference.accuracy.samples = 1024;
    scene.accuracy.adaptive.emplace().target_error = 1;
    const Rendered seen = scenes::render(scene), exact = scenes::render(reference);
    EXPECT_TRUE(seen.error.target_met);
    EXPECT_LT(compare(to_display(seen.image), to_display(exact.image))->rmse, 1.2) << static_cast<int>(layout);
  }
}

}  // namespace
