// Light that is neither lost nor made: furnaces, brighter lamps.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/stability/table.h"
#include "tests/support/effort.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

TEST(Energy, IsConservedByAMirrorInAConstantBackground) {
  Row row(23, "mirrors in a constant background: its bits", Oracle::conservation, "pixels");
  Scene scene = scenes::empty(64, {{0, 1, 6}, {0, 0, 0}, {0, 1, 0}, 60});
  scene.background.color = {0.1, 0.7, 1.3};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::mirror());
  scenes::add(scene, Sphere{{1.5, 0, 0}, 0.5}, scenes::mirror());
  scenes::add(scene, scenes::placed(scenes::icosphere(2), 0.7, {-1.5, 0, 0}), scenes::mirror());
  scene.accuracy.max_depth = 1000;
  const Rendered rendered = stability::render(scene);
  EXPECT_EQ(rendered.statistics.truncated_branches, 0u);
  for (std::uint32_t i = 0; i < 64 * 64; ++i) {
    const float* rgb = rendered.image.rgb.data() + 3 * static_cast<std::size_t>(i);
    row.expect(rgb[0] == 0.1F && rgb[1] == 0.7F && rgb[2] == 1.3F);
  }
}

TEST(Energy, IsConservedByGlassInAWhiteFurnace) {
  Row row(23, "white furnace: glass is not seen", Oracle::conservation, "pixels");
  Scene scene = scenes::empty(48, {{0, 0.2, 4}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::glass(1.5));
  scene.accuracy.max_depth = 4000;
  const Rendered rendered = stability::render(scene);
  EXPECT_EQ(rendered.statistics.non_finite, 0u);
  row.note("to 1e-4: near the rim light goes round for ever, depth 4000 leaves out less");
  // What depth leaves out is below (1-F) F^depth <= 1 / (e depth).
  for (std::size_t i = 0; i < rendered.image.rgb.size(); i += 3)
    row.expect(std::fabs(rendered.image.rgb[i] - 1) <= 1e-4F);
}

TEST(Light, IsLinearInPowersOfTwoOfTheIntensity) {
  Row row(24, "intensity times 2, 2^-20: bit for bit", Oracle::conservation, "values");
  for (std::uint64_t seed = 1; seed <= effort::cases(20); ++seed) {
    Scene scene = scenes::random(seed, 32);
    scene.ambient = {};
    scene.background.color = {};
    for (Material& m : scene.materials) m.emission = {};
    const std::vector<float> once = stability::render(scene).image.rgb;
    for (const double factor : {2.0, 0x1p-20}) {
      Scene brighter = scene;
      for (Light& light : brighter.lights) light.intensity *= factor;
      const std::vector<float> image = stability::render(brighter).image.rgb;
      for (std::size_t i = 0; i < image.size(); ++i) {
        const auto expected = static_cast<float>(once[i] * factor);
        // These have fewer digits.
        if (std::fpclassify(once[i]) == FP_SUBNORMAL || std::fpclassify(expected) == FP_SUBNORMAL) continue;
        row.expect(image[i] == expected);
      }
    }
  }
}

}  // namespace
