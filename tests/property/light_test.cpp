// Shadows where geometry says, mirrors that show what is there, light that is neither lost nor made.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace {

using oracle::Real;
using oracle::Vec;
using namespace tracer;

/// Unit direction through the centre of pixel (x, y) of a square picture.
Vec through(const Scene& scene, std::uint32_t x, std::uint32_t y) {
  const Camera& camera = scene.camera;
  const Vec forward = unit(Vec(camera.look_at) - Vec(camera.position)), right = unit(cross(forward, camera.up));
  const Real half = std::tan(camera.fov_deg * std::numbers::pi_v<Real> / 360), side = scene.image.height;
  return unit(forward + (half * ((2 * x + 1) / side - 1)) * right +
              (half * (1 - (2 * y + 1) / side)) * cross(right, forward));
}

TEST(Shadow, OfASphereOnAPlaneCoversExactlyThePixelsThatTheSphereHidesFromTheLight) {
  std::uint64_t wrong = 0, dark = 0, lit = 0;
  for (const double radius : {0.01, 0.3, 1.0, 1.9})
    for (const Vec3& light : {Vec3{1, 5, 2}, Vec3{-8, 2.5, 0}, Vec3{0, 4.0001, 0}}) {
      Scene scene = scenes::empty(effort::cases(100) < 100 ? 64 : 256);
      scene.camera = {{0.5, 30, 0.2}, {0, 0, 0}, {0, 0, -1}, 50};
      scene.lights = {scenes::point_light(light)};
      scenes::add(scene, Sphere{{0, 2, 0}, radius}, scenes::matte({1, 1, 1}));
      scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
      const Image image = scenes::render(scene).image;
      const Vec eye = scene.camera.position, center(0, 2, 0);
      for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
          const Vec d = through(scene, x, y);
          const Real seen = length(cross(d, center - eye));  // the line of sight's distance from the sphere's centre
          if (seen < radius * (1 + 1e-9)) continue;
          const Vec floor = eye + (-eye.y / d.y) * d, l = unit(Vec(light) - floor);
          const Real distance = length(cross(l, center - floor));
          if (std::fabs(distance - radius) < 1e-12L) continue;  // the edge itself
          const bool hidden = distance < radius;
          ++(hidden ? dark : lit);
          wrong += (image.pixel(x, y)[0] == 0) != hidden ? 1 : 0;
        }
    }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(dark, 1000u);
  EXPECT_GT(lit, dark);
}

TEST(Shadow, IsNotCastByTheSurfaceThatTheLampSitsOn) {
  // A tilted ceiling and a ball, each with lamps on it, to the last bit or one beside.
  oracle::Random random(1);
  const Vec normal = unit(Vec(0.1L, -1, 0.2L)), across = unit(cross(normal, Vec(0, 0, 1)));
  for (int i = 0; i < 40; ++i) {
    Scene open = scenes::empty(16);
    open.camera = {{0, 2, 6}, {0, 0, 0}, {0, 1, 0}, 20};
    scenes::add(open, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
    Scene closed = open;
    const bool ball = i % 2 == 0;
    const Vec lamp =
        ball ? Vec(0, 5, 0) - unit(Vec(random.in(-0.2, 0.2), 3, random.in(-0.2, 0.2)))
             : Vec(0, 4, 0) + Real(random.in(-1, 1)) * across + Real(random.in(-1, 1)) * cross(normal, across);
    open.lights = closed.lights = {scenes::point_light(rounded(lamp))};
    if (ball) {
      scenes::add(closed, Sphere{{0, 5, 0}, 1}, scenes::matte({1, 1, 1}));
    } else {
      scenes::add(closed, Plane{{0, 4, 0}, rounded(normal), {}}, scenes::matte({1, 1, 1}));
    }
    const auto expected = scenes::render(open).image.rgb, image = scenes::render(closed).image.rgb;
    for (std::size_t p = 0; p < image.size(); ++p)
      ASSERT_FLOAT_EQ(image[p], expected[p]) << (ball ? "ball" : "ceiling");
  }
}

TEST(Shadow, OfABallHoldsTheLightThatIsInsideIt) {
  Scene scene = scenes::empty(32);
  scene.camera = {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 20};
  scene.lights = {scenes::point_light({0, 0.5, 0})};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::matte({1, 1, 1}));
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  for (const float value : scenes::render(scene).image.rgb) ASSERT_EQ(value, 0) << "no light gets out";
  scene.camera = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 150};
  for (const float value : scenes::render(scene).image.rgb) ASSERT_GT(value, 0) << "all of the inside is lit";
}

TEST(PlaneMirror, ShowsWhatACameraBehindItWouldSeeLeftForRight) {
  for (std::uint64_t seed = 1; seed <= effort::cases(20); ++seed) {
    // Spheres and lamps before the mirror x = 0, and nothing whose own rays the mirror would catch.
    Scene behind = scenes::random(seed, 40);
    std::erase_if(behind.objects, [](const Object& o) { return std::holds_alternative<Plane>(o.shape); });
    for (Object& object : behind.objects) std::get<Sphere>(object.shape).center.x += 20;
    for (Material& material : behind.materials) material.reflection = material.transmission = 0;
    for (Light& light : behind.lights) light.source = PointLight{{12 + static_cast<double>(seed), 9, -3}};
    behind.camera = {{-10, 0.3, 0.2}, {20, 0, 0}, {0, 1, 0}, 20};
    behind.accuracy.max_depth = 6;
    Scene mirrored = behind;
    mirrored.camera.position.x = 10;
    mirrored.camera.look_at.x = -20;
    mirrored.accuracy.max_depth = 7;
    scenes::add(mirrored, Plane{{0, 0, 0}, {1, 0, 0}, {}}, scenes::mirror());
    const Image expected = scenes::render(behind).image, image = scenes::render(mirrored).image;
    std::uint64_t different = 0;
    for (std::uint32_t y = 0; y < 40; ++y)
      for (std::uint32_t x = 0; x < 40; ++x)
        for (int c = 0; c < 3; ++c) {
          const float a = image.pixel(x, y)[c], b = expected.pixel(39 - x, y)[c];
          different += std::fabs(a - b) > 1e-6F * b + 1e-9F ? 1 : 0;
        }
    EXPECT_EQ(different, 0u) << "seed " << seed;
  }
}

TEST(Energy, AMirrorInAConstantBackgroundIsTheBackgroundToTheLastBit) {
  Scene scene = scenes::empty(64);
  scene.camera = {{0, 1, 6}, {0, 0, 0}, {0, 1, 0}, 60};
  scene.background.color = {0.1, 0.7, 1.3};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::mirror());
  scenes::add(scene, Sphere{{1.5, 0, 0}, 0.5}, scenes::mirror());
  scenes::add(scene, scenes::placed(scenes::icosphere(2), 0.7, {-1.5, 0, 0}), scenes::mirror());
  scene.accuracy.max_depth = 1000;
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.truncated_branches, 0u);
  for (std::uint32_t i = 0; i < 64 * 64; ++i) {
    ASSERT_EQ(rendered.image.rgb[3 * i], 0.1F);
    ASSERT_EQ(rendered.image.rgb[3 * i + 1], 0.7F);
    ASSERT_EQ(rendered.image.rgb[3 * i + 2], 1.3F);
  }
}

TEST(Energy, GlassInAWhiteFurnaceDisappears) {
  Scene scene = scenes::empty(48);
  scene.camera = {{0, 0.2, 4}, {0, 0, 0}, {0, 1, 0}, 40};
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::glass(1.5));
  scene.accuracy.max_depth = 4000;
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.non_finite, 0u);
  // Near the rim, light goes round inside for ever: what depth leaves out is below (1-F) F^depth <= 1 / (e depth).
  for (const float value : rendered.image.rgb) ASSERT_NEAR(value, 1, 1e-4);
}

TEST(Energy, InAClosedRoomOfAmbientLightEverySurfaceHasItsOwnColour) {
  Scene scene = scenes::empty(16);
  scene.camera = {{0.2, 0.1, 0}, {1, 0, 0}, {0, 1, 0}, 120};
  scene.ambient = {1, 0.5, 0.25};
  Material wall = scenes::matte({0.5, 0.5, 0.5});
  wall.ambient = 0.5;
  scenes::add(scene, Sphere{{0, 0, 0}, 3}, wall);
  const Image image = scenes::render(scene).image;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    ASSERT_EQ(image.rgb[i], 0.25F);
    ASSERT_EQ(image.rgb[i + 1], 0.125F);
    ASSERT_EQ(image.rgb[i + 2], 0.0625F);
  }
}

/// Largest difference of two pictures, relative to the brightest value.
float difference(const std::vector<float>& a, const std::vector<float>& b) {
  float largest = 0, brightest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::fabs(a[i] - b[i]));
    brightest = std::max(brightest, std::max(a[i], b[i]));
  }
  return largest / brightest;
}

TEST(Light, OfTwoLampsIsTheSumOfTheirPictures) {
  for (std::uint64_t seed = 1; seed <= effort::cases(20); ++seed) {
    Scene both = scenes::random(seed, 32);
    both.ambient = {};
    both.background.color = {};
    for (Material& m : both.materials) m.emission = {};
    Scene first = both, second = both;
    first.lights.pop_back();
    second.lights.erase(second.lights.begin());
    std::vector<float> sum = scenes::render(first).image.rgb;
    const std::vector<float> other = scenes::render(second).image.rgb;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
    const auto together = scenes::render(both).image.rgb;
    if (*std::max_element(together.begin(), together.end()) == 0) continue;
    EXPECT_LE(difference(together, sum), 3e-7F) << "seed " << seed;
  }
}

TEST(Light, IsLinearInIntensityAndBitForBitInPowersOfTwo) {
  for (std::uint64_t seed = 1; seed <= effort::cases(20); ++seed) {
    Scene scene = scenes::random(seed, 32);
    scene.ambient = {};
    scene.background.color = {};
    for (Material& m : scene.materials) m.emission = {};
    std::vector<float> once = scenes::render(scene).image.rgb;
    for (const double factor : {2.0, 0x1p-20, 3.0, 1e-3}) {
      Scene brighter = scene;
      for (Light& light : brighter.lights) light.intensity *= factor;
      const std::vector<float> image = scenes::render(brighter).image.rgb;
      for (std::size_t i = 0; i < image.size(); ++i) {
        const auto expected = static_cast<float>(once[i] * factor);
        if (factor == 2 || factor == 0x1p-20) {
          ASSERT_EQ(image[i], expected) << "seed " << seed << " factor " << factor;
        } else {
          ASSERT_NEAR(image[i], expected, 2e-7F * expected) << "seed " << seed << " factor " << factor;
        }
      }
    }
  }
}

}  // namespace
