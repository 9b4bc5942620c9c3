// The division of surfaces into patches.
#include "tracer/src/radiosity/patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace {

using namespace tracer;

constexpr Vec2 no_offset{0.5, 0.5};

TEST(PatchGrid, KeepsObjectsSidesAndCellsApart) {
  PatchGrid grid(1);
  const std::uint32_t first = grid.insert(0, {0.1, 0.1, 0}, {0, 0, 1});
  EXPECT_EQ(grid.insert(0, {0.2, 0.3, 0}, {0, 0, 1}), first);
  EXPECT_EQ(grid.insert(1, {0.1, 0.1, 0}, {0, 0, 1}), 1u);
  EXPECT_EQ(grid.insert(0, {0.1, 0.1, 0}, {0, 0, -1}), 2u);
  EXPECT_EQ(grid.insert(0, {1.1, 0.1, 0}, {0, 0, 1}), 3u);
  EXPECT_EQ(grid.insert(0, {0.1, 0.1, 0}, normalize(Vec3{0.5, 0, 1})), 4u);
  EXPECT_EQ(grid.size(), 5u);
  EXPECT_EQ(grid.find(0, {0.3, 0.2, 0}, {0, 0, 1}, no_offset), first);
  EXPECT_EQ(grid.find(2, {0.3, 0.2, 0}, {0, 0, 1}, no_offset), PatchGrid::none);
}

TEST(PatchGrid, InterpolatesBetweenPatchesInTheMean) {
  PatchGrid grid(1);
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y) grid.insert(0, {x + 0.13, y + 0.13, 0}, {0, 0, 1});
  // A tenth of a cell from the border, the choices from half a cell to a tenth of one on this side stay.
  const double border = 0.63;
  const std::uint32_t left = grid.find(0, {border - 0.1, 0.13, 0}, {0, 0, 1}, no_offset);
  int beyond = 0;
  constexpr int choices = 1000;
  for (int i = 0; i < choices; ++i)
    beyond += grid.find(0, {border - 0.1, 0.13, 0}, {0, 0, 1}, {(i + 0.5) / choices, 0.5}) != left ? 1 : 0;
  EXPECT_EQ(beyond, 400);
}

TEST(PatchGrid, StaysOnTheSurfaceWhereNoPatchIsBeside) {
  PatchGrid grid(1);
  const std::uint32_t only = grid.insert(0, {0.1, 0.1, 0}, {0, 0, 1});
  for (const Vec2 xi : {Vec2{0, 0}, Vec2{0.99, 0}, Vec2{0.99, 0.99}})
    EXPECT_EQ(grid.find(0, {0.1, 0.1, 0}, {0, 0, 1}, xi), only);
}

/// Patches of a unit sphere, seen from inside, that hold the mean of a linear function.
class DividedSphere {
 public:
  explicit DividedSphere(double side) : grid_(side) {
    constexpr std::uint32_t points = 40'000;
    std::vector<double> counts;
    for (std::uint32_t i = 0; i < points; ++i) {
      const Vec3 at = place(sequence_point(i, 1));
      const std::uint32_t patch = grid_.insert(0, at, -at);
      if (patch == values_.size()) {
        values_.push_back(0);
        counts.push_back(0);
      }
      values_[patch] += truth(at);
      ++counts[patch];
    }
    for (std::size_t patch = 0; patch < values_.size(); ++patch) values_[patch] /= counts[patch];
  }

  static Vec3 place(const Vec2& xi) {
    const double z = 1 - 2 * xi.x, across = std::sqrt(1 - z * z), angle = 2 * std::numbers::pi * xi.y;
    return {across * std::cos(angle), across * std::sin(angle), z};
  }
  static double truth(const Vec3& at) { return at.x + 0.7 * at.y - 0.4 * at.z; }
  /// The mean over the choices; the exact value where there is no patch.
  [[nodiscard]] double found(const Vec3& at) const {
    constexpr std::uint32_t choices = 256;
    double sum = 0;
    for (std::uint32_t i = 0; i < choices; ++i) {
      const std::uint32_t patch = grid_.find(0, at, -at, sequence_point(i, 2));
      sum += patch == PatchGrid::none ? truth(at) : values_[patch];
    }
    return sum / choices;
  }

 private:
  PatchGrid grid_;
  std::vector<double> values_;
};

TEST(PatchGrid, InterpolatesAcrossTheNormalsAtWhichPatchesOfASphereEnd) {
  constexpr double side = 0.12;
  const DividedSphere sphere(side);
  const auto mean_step = [&](const std::function<Vec3(double)>& along) {
    constexpr int places = 50;
    double sum = 0;
    for (int i = 0; i < places; ++i) {
      const double t = (i + 0.5) / places - 0.5;
      const Vec3 at = along(t);
      const Vec3 across = normalize(cross(at, along(t + 1e-3) - at)) * 1e-6;
      sum += std::abs(sphere.found(normalize(at + across)) - sphere.found(normalize(at - across)));
    }
    return sum / places / side;
  };
  const auto x_is_dominant = [](double t) { return normalize(Vec3{1, t, 0.9}); };
  const auto x_and_z_are_equal = [](double t) { return normalize(Vec3{1, t, 1}); };
  const auto part_of_z_ends = [](double t) { return normalize(Vec3{1, t, 1.0 / 3}); };
  EXPECT_LT(mean_step(x_is_dominant), 0.02);
  EXPECT_LT(mean_step(x_and_z_are_equal), 0.1);
  EXPECT_LT(mean_step(part_of_z_ends), 0.1);
}

}  // namespace
