// Smoothing of the light of patches: noise goes, gradients and edges stay.
#include "tracer/src/radiosity/smoothing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"
#include "tracer/src/radiosity/patches.h"

namespace {

using namespace tracer;

constexpr int side = 40;

PatchNeighbors square() {
  const auto number = [](int x, int y) {
    const bool inside = x >= 0 && x < side && y >= 0 && y < side;
    return inside ? static_cast<std::uint32_t>(y * side + x) : PatchGrid::none;
  };
  PatchNeighbors neighbors;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      auto& pairs = neighbors.emplace_back();
      for (const auto& [i, a, b] : {std::array{0, 1, 0}, {1, 0, 1}, {2, 1, 1}, {3, 1, -1}})
        pairs[static_cast<std::size_t>(i)] = {number(x + a, y + b), number(x - a, y - b)};
    }
  return neighbors;
}

/// Root mean square of the noise that is left of both solutions, where `value(x, y)` is the truth.
template <class Value>
double noise_left(const Value& value, double noise) {
  oracle::Random random(11);
  std::array<std::vector<Color>, 2> solutions;
  for (std::vector<Color>& solution : solutions)
    for (int i = 0; i < side * side; ++i) {
      const double truth = value(i % side, i / side);
      solution.push_back({truth + random.in(-noise, noise), truth + random.in(-noise, noise), truth});
    }
  smooth(solutions, square());
  double squares = 0;
  for (const std::vector<Color>& solution : solutions)
    for (std::size_t i = 0; i < solution.size(); ++i) {
      const Color& color = solution[i];
      const double truth = value(static_cast<int>(i) % side, static_cast<int>(i) / side);
      squares += (std::pow(color.r - truth, 2) + std::pow(color.g - truth, 2)) / (4. * side * side);
    }
  return std::sqrt(squares);
}

TEST(Smoothing, RemovesMostOfTheNoiseOfAGradient) {
  const double raw = 0.1 / std::sqrt(3.0);
  EXPECT_LT(noise_left([](int x, int y) { return 1 + 0.02 * x - 0.01 * y; }, 0.1), 0.3 * raw);
}

TEST(Smoothing, KeepsAGradientWithoutNoise) {
  EXPECT_LT(noise_left([](int x, int y) { return 1 + 0.02 * x - 0.01 * y; }, 0), 1e-14);
}

TEST(Smoothing, KeepsEdges) {
  const auto edge = [](int x, int) { return x < side / 2 ? 0.0 : 1.0; };
  EXPECT_EQ(noise_left(edge, 0), 0);
  EXPECT_LT(noise_left(edge, 0.1), 0.7 * 0.1 / std::sqrt(3.0));
}

}  // namespace
