// Camera rays beside the pinhole's geometry in long double.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/cameras/perspective.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

PerspectiveCamera camera_of(const Camera& camera, std::uint32_t width, std::uint32_t height) {
  return {camera, {width, height}, camera.position};
}

void expect_near(const Vec3& actual, const Vec& expected, double tolerance) {
  EXPECT_NEAR(actual.x, static_cast<double>(expected.x), tolerance);
  EXPECT_NEAR(actual.y, static_cast<double>(expected.y), tolerance);
  EXPECT_NEAR(actual.z, static_cast<double>(expected.z), tolerance);
}

TEST(PerspectiveCamera, LooksAlongMinusZWithXToTheRightAndRowNoughtOnTop) {
  // 90 degrees, 4 x 2 pixels: the window is 4 wide and 2 high at distance 1.
  const auto camera = camera_of({{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90}, 4, 2);
  expect_near(camera.direction(2, 1), {0, 0, -1}, 1e-16);
  expect_near(camera.direction(0, 0), unit(Vec(-2, 1, -1)), 1e-15);            // upper left
  expect_near(camera.direction(4, 0), unit(Vec(2, 1, -1)), 1e-15);             // upper right
  expect_near(camera.direction(4, 2), unit(Vec(2, -1, -1)), 1e-15);            // lower right
  expect_near(camera.direction(0.5, 0.5), unit(Vec(-1.5L, 0.5L, -1)), 1e-15);  // the first pixel's centre
}

TEST(PerspectiveCamera, RaysAreThePinholesForRandomViews) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(5000); ++i) {
    const double scale = random.spread(1e-50, 1e50);
    Camera c{random.vector(scale), random.vector(scale), random.vector(random.spread(1e-50, 1e50)),
             random.in(0.001, 179.9)};
    const std::uint32_t width = 1 + random.below(2000), height = 1 + random.below(2000);
    const auto camera = camera_of(c, width, height);
    const Vec forward = unit(Vec(c.look_at) - Vec(c.position));
    const Vec sideways = cross(forward, unit(c.up));
    if (length(sideways) < 1e-3L) continue;
    const Vec right = unit(sideways), up = cross(right, forward);
    const Real pixel = 2 * std::tan(c.fov_deg / 360 * std::numbers::pi_v<Real>) / height;
    const double x = random.in(0, width), y = random.in(0, height);
    const Vec expected = unit(forward + (pixel * (x - width / 2.0L)) * right + (pixel * (height / 2.0L - y)) * up);
    expect_near(camera.direction(x, y), expected, 1e-12);
    EXPECT_NEAR(static_cast<double>(length(Vec(camera.direction(x, y)))), 1, 4e-16);
    if (HasFailure()) return;
  }
}

TEST(PerspectiveCamera, SpansItsFieldOfViewVertically) {
  for (const double fov : {1.0, 45.0, 90.0, 150.0}) {
    const auto camera = camera_of({{0, 0, 0}, {1, 2, 3}, {0, 1, 0}, fov}, 300, 200);
    const Vec top = camera.direction(150, 0), bottom = camera.direction(150, 200);
    EXPECT_NEAR(static_cast<double>(std::acos(dot(top, bottom))) * 180 / std::numbers::pi, fov, 1e-10);
  }
}

TEST(PerspectiveCamera, NeedsNoUprightUp) {
  const Camera upright{{1, 2, 3}, {4, -1, 0}, {0, 1, 0}, 45};
  Camera slanted = upright;
  slanted.up = {3 * 5e-3, 1 - 3 * 5e-3, -3 * 5e-3};  // up plus a part of the view
  expect_near(camera_of(slanted, 9, 9).direction(1, 2), Vec(camera_of(upright, 9, 9).direction(1, 2)), 1e-15);
}

}  // namespace
}  // namespace tracer
