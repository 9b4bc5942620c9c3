#pragma once
/// Radiance of scenes of global light, as a mean of independent renders with fixed seeds.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/support/scenes.h"
#include "tracer/compare.h"

namespace tracer {

constexpr double pi = std::numbers::pi;

struct Mean {
  double value = 0, error = 0;
};

/// Mean of a channel over the whole image.
inline double mean_radiance(const Image& image, std::size_t channel = 0) {
  double sum = 0;
  for (std::size_t i = channel; i < image.rgb.size(); i += 3) sum += image.rgb[i];
  return sum / (static_cast<double>(image.rgb.size()) / 3);
}

/// Over renders with different seeds.
template <class Value>
Mean mean_over_seeds(Scene scene, const Value& value, std::uint64_t seeds = 24) {
  double sum = 0, squares = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    scene.accuracy.seed = seed;
    const double one = value(scene);
    sum += one;
    squares += one * one;
  }
  const auto n = static_cast<double>(seeds);
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

inline Mean radiance(const Scene& scene, std::uint64_t seeds = 24, const Assets& assets = {}) {
  return mean_over_seeds(
      scene, [&](const Scene& one) { return mean_radiance(scenes::render(one, 1, assets).image); }, seeds);
}

/// The displayed level of a gray radiance.
inline double level_of(double radiance) {
  const auto value = static_cast<float>(radiance);
  return to_display({.width = 1, .height = 1, .rgb = {value, value, value}}).codes[0] / codes_per_level;
}

inline void expect_mean(const Mean& found, double truth, const std::string& name) {
  EXPECT_LE(std::abs(found.value - truth), 4 * found.error + 1e-6 * truth)
      << name << ": " << found.value << " +- " << found.error << ", must be " << truth;
  EXPECT_LE(std::abs(found.value - truth), 0.005 * truth) << name << ": " << found.value << " +- " << found.error;
}

inline Material surface(double diffuse, double emission = 0) {
  Material material = scenes::matte({1, 1, 1});
  material.ambient = 0;
  material.diffuse = diffuse;
  material.emission = Color{emission, emission, emission};
  return material;
}

/// Two by two pixels of a narrow view from `position` to `target`.
inline Scene view_of(const Vec3& target, const Vec3& position, std::uint32_t samples) {
  Scene scene = scenes::empty(2, {position, target, {0, 0.6, 0.8}, 0.05});
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.samples = samples;
  scene.accuracy.max_depth = 1000;
  return scene;
}

}  // namespace tracer
