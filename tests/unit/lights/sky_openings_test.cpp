// Directions toward a sky behind openings.
#include "tracer/src/lights/sky_openings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tracer/src/math/sampling.h"

namespace {

using namespace tracer;

constexpr std::uint32_t rays = 1 << 14;
const Bounds room_box{{-1, 0, 2}, {3, 2, 5}};

/// A window in the face at high x.
constexpr double y_low = 0.5, y_high = 1.3, z_low = 3, z_high = 4.5;

bool is_through_window(const Vec3& from, const Vec3& direction) {
  const double t = (room_box.high.x - from.x) / direction.x;
  const Vec3 at = from + direction * t;
  return t > 0 && at.y > y_low && at.y < y_high && at.z > z_low && at.z < z_high;
}

Vec3 within_box(std::uint32_t i) {
  const Vec2 xi = sequence_point(i, mix(1)), other = shuffled_point(i, mix(2));
  return {-1 + 3.9 * xi.x, 2 * xi.y, 2 + 3 * other.x};
}

std::vector<SkySighting> through_window(double power = 1) {
  std::vector<SkySighting> sightings;
  for (std::uint32_t i = 0; i < rays; ++i) {
    const Vec2 xi = shuffled_point(i, mix(3));
    const Vec3 from = within_box(i);
    const Vec3 to{room_box.high.x, y_low + (y_high - y_low) * xi.x, z_low + (z_high - z_low) * xi.y};
    sightings.push_back({from, normalize(to - from), power});
  }
  return sightings;
}

TEST(SkyOpenings, AreSampledWithTheirDensity) {
  const SkyOpenings openings(room_box, through_window());
  for (const Vec3& from : {Vec3{0, 1, 3}, Vec3{2.9, 0.6, 4}, Vec3{-0.999, 1.999, 2.001}}) {
    double hits = 0;
    for (std::uint32_t i = 0; i < rays; ++i) {
      const SkyOpenings::Sample sample = openings.sample(from, sequence_point(i, mix(4)));
      ASSERT_NEAR(length(sample.direction), 1, 1e-12);
      ASSERT_NEAR(sample.density, openings.density(from, sample.direction), 1e-6 * sample.density);
      hits += is_through_window(from, sample.direction) ? 1.0 / rays : 0;
    }
    EXPECT_GT(hits, 0.93) << "samples are in the window, but for its cells at the edges";
  }
}

TEST(SkyOpenings, HaveADensityThatIntegratesToOne) {
  const SkyOpenings openings(room_box, through_window());
  for (const Vec3& from : {Vec3{0, 1, 3}, Vec3{2, 1.9, 2.1}}) {
    double integral = 0;
    for (std::uint32_t i = 0; i < 16 * rays; ++i) {
      const Vec2 xi = sequence_point(i, mix(5));
      const double z = 1 - 2 * xi.x, across = std::sqrt(1 - z * z), angle = 2 * std::numbers::pi * xi.y;
      const Vec3 direction{across * std::cos(angle), across * std::sin(angle), z};
      integral += openings.density(from, direction) * 4 * std::numbers::pi / (16 * rays);
    }
    EXPECT_NEAR(integral, 1, 0.01);
  }
}

TEST(SkyOpenings, AreNotSampledFromOutsideTheBox) {
  const SkyOpenings openings(room_box, through_window());
  for (const Vec3& from : {Vec3{3, 1, 3}, Vec3{-2, 1, 3}, Vec3{0, 1, std::numeric_limits<double>::quiet_NaN()}}) {
    EXPECT_EQ(openings.sample(from, {0.5, 0.5}).density, 0);
    EXPECT_EQ(openings.density(from, {1, 0, 0}), 0);
  }
}

TEST(SkyOpenings, AreNoneWithoutLightOrWithTooMuch) {
  EXPECT_TRUE(SkyOpenings(room_box, {}).empty());
  EXPECT_TRUE(SkyOpenings({{9, 9, 9}, {10, 10, 10}}, through_window()).empty());
  for (const double power : {0.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_TRUE(SkyOpenings(room_box, through_window(power)).empty()) << power;
}

}  // namespace
