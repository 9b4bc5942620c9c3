// Penumbrae have the width of similar triangles, and their radiance is the visible part of the light.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/scenes.h"

namespace {

using namespace tracer;

constexpr double lamp_height = 100, edge_height = 1, reach = 5;  // the lamp spans 2 reach across the edge

/// A strip of floor across the shadow of a straight edge over x = 0, seen from under the sheet that casts it.
Scene strip(const LightSource& lamp) {
  Scene scene = scenes::empty(1);
  scene.image = {64, 1};
  scene.camera = {{0, 0.5, 0}, {0, 0, 0}, {0, 0, -1}, 45};
  scene.camera.type = Camera::Type::orthographic;
  scene.camera.height = 0.004;
  scene.accuracy.samples = 1024;
  scene.lights.emplace_back().source = lamp;
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  const Mesh sheet{{{-900, edge_height, -900}, {0, edge_height, -900}, {0, edge_height, 900}, {-900, edge_height, 900}},
                   {{0, 1, 2}, {0, 2, 3}},
                   {},
                   {},
                   false};
  scenes::add(scene, sheet, scenes::matte({1, 1, 1}));
  return scene;
}

/// `part` is that of the lamp on one side of a line at x reaches from its middle, from 0 at x = -1 to 1 at x = 1.
void expect_penumbra(const LightSource& lamp, const std::function<double(double)>& part) {
  Scene scene = strip(lamp);
  const auto shadowed = scenes::render(scene, 2).image;
  scene.lights[0].shadows = false;
  const auto open = scenes::render(scene, 2).image;
  for (std::uint32_t i = 0; i < 64; ++i) {
    // From floor point f the edge hides what of the lamp lies at x < -f (H - h) / h.
    const double f = (i - 31.5) * 0.004, half_pixel = 0.5;
    const auto seen = [&](double pixel) {
      const double x = (f + pixel * 0.004) * (lamp_height - edge_height) / (edge_height * reach);
      return part(std::clamp(x, -1.0, 1.0));
    };
    const double light = shadowed.pixel(i, 0)[0] / open.pixel(i, 0)[0];
    const double expected = (seen(-half_pixel) + 4 * seen(0) + seen(half_pixel)) / 6;
    if (seen(half_pixel) == 0) {
      EXPECT_EQ(light, 0) << "umbra, pixel " << i;
    } else if (seen(-half_pixel) == 1) {
      EXPECT_EQ(light, 1) << "open, pixel " << i;
    } else {
      EXPECT_NEAR(light, expected, 0.01) << "pixel " << i;
    }
  }
}

TEST(Penumbra, OfALineARectAndASphereIsLinearInItsWidth) {
  const auto evenly = [](double x) { return (1 + x) / 2; };
  expect_penumbra(LineLight{{-reach, lamp_height, 0}, {reach, lamp_height, 0}}, evenly);
  expect_penumbra(RectLight{{-reach, lamp_height, -3}, {2 * reach, 0, 0}, {0, 0, 6}}, evenly);
  expect_penumbra(SphereLight{{0, lamp_height, 0}, reach},
                  evenly);  // a sphere's zones are as their heights (Archimedes)
}

TEST(Penumbra, OfADiscGrowsAsTheAreaOfItsSegment) {
  expect_penumbra(DiscLight{{0, lamp_height, 0}, {0, -1, 0}, reach}, [](double x) {
    return std::abs(x) == 1 ? (1 + x) / 2 : 0.5 + (x * std::sqrt(1 - x * x) + std::asin(x)) / std::numbers::pi;
  });
}

}  // namespace
