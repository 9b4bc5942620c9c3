// The parts `depth` and `cutoff` of the error against their true size: the difference between images of many samples
// with the limits of the document and with much lower ones. No ray of these ends by chance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/compare.h"

namespace {

using namespace tracer;

/// Spheres and planes of mirrors and glass that return less light than they receive, with limits of all kinds.
Scene limited_scene(std::uint64_t seed) {
  Scene scene = scenes::random(seed, 64);
  for (Material& material : scene.materials) {
    const double sum = std::max(0.9, material.reflection + material.transmission);
    material.reflection *= 0.9 / sum;
    material.transmission *= 0.9 / sum;
  }
  oracle::Random random(seed);
  scenes::end_by_chance(scene);
  if (seed % 3 != 0) scene.accuracy.cutoff = random.spread(1e-3, 0.5);
  if (seed % 3 != 1) scene.accuracy.max_depth = static_cast<std::uint32_t>(random.in(0, 6));
  scene.accuracy.samples = seed % 4 == 0 ? 1 : 4;
  if (seed % 4 == 3) scene.accuracy.adaptive.emplace().target_error = 2;
  return scene;
}

/// The displayed image of many samples that end at these limits at the latest.
DisplayImage long_trace(Scene scene, std::uint64_t seed) {
  Accuracy& accuracy = scene.accuracy;
  accuracy.adaptive.reset();
  accuracy.samples = 128;
  accuracy.seed = 1000 + seed;
  if (!accuracy.cutoff) accuracy.cutoff = 1e-4;
  if (!accuracy.max_depth) accuracy.max_depth = 200;
  return to_display(scenes::render(scene, 2).image, scene.output);
}

/// Root mean square of what the limits change. Both images have the same samples; the product over two seeds has no
/// noise in the mean.
double truth_of(const Scene& limited) {
  Scene whole = limited;
  scenes::end_by_chance(whole);
  std::vector<double> product;
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    const DisplayImage with = long_trace(limited, seed), without = long_trace(whole, seed);
    product.resize(with.codes.size(), 1);
    for (std::size_t i = 0; i < product.size(); ++i)
      product[i] *= (double{without.codes[i]} - with.codes[i]) / codes_per_level;
  }
  const double sum = std::accumulate(product.begin(), product.end(), 0.0);
  return std::sqrt(std::max(0.0, sum / static_cast<double>(product.size())));
}

TEST(TruncationError, IsWithinAFactorOfTwoOnThirtyScenesOfMirrorsAndGlass) {
  int count = 0;
  double logarithms = 0;
  for (std::uint64_t seed = 0; count < 30; ++seed) {
    const Scene scene = limited_scene(seed);
    const double truth = truth_of(scene);
    if (truth < 0.1) continue;
    ++count;
    const ErrorEstimate error = scenes::render(scene, 2).error;
    const double ratio = std::sqrt(std::pow(error.estimate, 2) - std::pow(error.sampling, 2)) / truth;
    logarithms += std::log(ratio);
    EXPECT_TRUE(ratio > 0.5 && ratio < 2) << "scene " << seed << ": " << ratio << " of " << truth;
    RecordProperty("scene_" + std::to_string(seed), std::to_string(truth) + " " + std::to_string(ratio));
  }
  EXPECT_GT(std::exp(logarithms / count), 0.9) << "95 % confidence is above the mean";
}

}  // namespace
