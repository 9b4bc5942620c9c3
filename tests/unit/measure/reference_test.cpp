// Standard error of the reference for images with known variance.
#include <gtest/gtest.h>

#include <cmath>

#include "tracer/measure.h"
#include "tracer/src/display/srgb.h"

namespace {

tracer::Scene small_scene() {
  tracer::Scene scene;
  scene.image.width = 3;
  scene.image.height = 2;
  return scene;
}

/// The display value of every pixel is `level`.
tracer::Image flat(double level) {
  tracer::Image image;
  image.width = 3;
  image.height = 2;
  image.rgb.assign(18, static_cast<float>(tracer::linear_from_srgb(level / 255)));
  return image;
}

TEST(Reference, HasTheStandardErrorOfTheMeanOfItsImages) {
  tracer::Reference reference = tracer::empty_reference(small_scene(), 64);
  for (const double level : {99.0, 101.0, 99.0, 101.0}) add(reference, flat(level));
  EXPECT_NEAR(standard_error(reference, {}), std::sqrt(4.0 / 3) / 2, 1e-3);  // variance 4/3 of the four, over 4
}

TEST(Reference, OfEqualImagesHasNoError) {
  tracer::Reference reference = tracer::empty_reference(small_scene(), 64);
  for (int i = 0; i < 7; ++i) add(reference, flat(77.7));
  EXPECT_EQ(standard_error(reference, {}), 0);
}

TEST(Reference, AveragesRadianceInsteadOfCodes) {
  tracer::Reference reference = tracer::empty_reference(small_scene(), 64);
  add(reference, flat(0));
  add(reference, flat(255));
  EXPECT_NEAR(to_display(reference, {}).codes[0] / tracer::codes_per_level, 187.516, 1e-2);  // sRGB of one half
}

TEST(Reference, UsesADifferentSeedForEachImage) {
  tracer::Scene scene = small_scene();
  scene.accuracy.seed = 7;
  tracer::Reference reference = tracer::empty_reference(scene, 64);
  const auto first = reference_scene(scene, reference).accuracy;
  add(reference, flat(1));
  const auto second = reference_scene(scene, reference).accuracy;
  EXPECT_NE(first.seed, scene.accuracy.seed);
  EXPECT_NE(second.seed, scene.accuracy.seed);
  EXPECT_NE(first.seed, second.seed);
}

TEST(Reference, UsesUnfilteredTexturesAndExactModels) {
  tracer::Scene scene = small_scene();
  scene.textures.resize(2);
  scene.textures[1].filter = tracer::Texture::Filter::nearest;
  scene.accuracy.approximate.shadows = tracer::Approximations::Shadows::none;
  scene.accuracy.adaptive.emplace();
  const tracer::Scene independent = reference_scene(scene, tracer::empty_reference(scene, 64));
  EXPECT_EQ(independent.textures[0].filter, tracer::Texture::Filter::bilinear);
  EXPECT_EQ(independent.textures[1].filter, tracer::Texture::Filter::nearest);
  EXPECT_FALSE(independent.accuracy.approximate.any());
  EXPECT_FALSE(independent.accuracy.adaptive);
}

}  // namespace
