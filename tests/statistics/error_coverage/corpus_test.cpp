// The corpus: its sizes exceed the size up to which every pixel is validated, and its closed forms are correct.
#include "tests/statistics/error_coverage/corpus.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/statistics/error_coverage/truth.h"
#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tracer/requirements.h"
#include "tracer/validate.h"

namespace {

using namespace error_coverage;
using oracle::Random;

/// Share of the pixels at which 1024 looks are, if all of them have only their pilot.
double validated_share(const Canvas& canvas) { return 1024.0 / (static_cast<double>(canvas.width) * canvas.height); }

TEST(ErrorCorpus, LeavesPixelsOutOfEveryValidation) {
  double share = 0;
  constexpr int count = 50;
  for (std::uint64_t seed = 1; seed <= count; ++seed) share += validated_share(grammar_scene(seed).canvas) / count;
  EXPECT_LT(share, 0.25);
}

TEST(ErrorCorpus, HasValidScenesWithExactImagesOfTheirSize) {
  std::set<std::string> names;
  for (const CorpusEntry& entry : corpus()) {
    SCOPED_TRACE(entry.family + ": " + entry.name);
    EXPECT_TRUE(names.insert(entry.family + entry.name).second);
    Random random(2);
    const CorpusScene scene = entry.build({160, 120}, random);
    const auto issues = tracer::validate(scene.scene, tracer::Limits{});
    EXPECT_TRUE(issues.empty()) << issues[0].pointer << ": " << issues[0].detail;
    EXPECT_GE(scene.scene.image.width, 160u);
    EXPECT_EQ(scene.exact.has_value(), entry.exact);
    if (scene.exact) {
      EXPECT_EQ(scene.exact->width, scene.scene.image.width);
    }
  }
}

TEST(ErrorCorpus, HasEveryRequirementShapeLightAndTexture) {
  std::set<std::string_view> requirements;
  std::set<std::size_t> shapes, lights, textures;
  for (const CorpusEntry& entry : corpus()) {
    Random random(1);
    const tracer::Scene scene = entry.build({160, 120}, random).scene;
    const tracer::Requirements needed = tracer::requirements(scene);
    for (const tracer::RequirementName& each : tracer::requirement_names)
      if (needed.*each.needed) requirements.insert(each.name);
    for (const tracer::Object& object : scene.objects) shapes.insert(object.shape.index());
    for (const tracer::Light& light : scene.lights) lights.insert(light.source.index());
    for (const tracer::Texture& texture : scene.textures) textures.insert(texture.pattern.index());
  }
  // The runner requests layers, and ModelError compares approximated light between surfaces with references.
  requirements.insert({"layers", "interreflection"});
  for (const tracer::RequirementName& each : tracer::requirement_names)
    EXPECT_TRUE(requirements.contains(each.name)) << each.name;
  EXPECT_EQ(shapes.size(), std::variant_size_v<tracer::Shape>);
  EXPECT_EQ(lights.size(), std::variant_size_v<tracer::LightSource>);
  EXPECT_EQ(textures.size(), std::variant_size_v<decltype(tracer::Texture::pattern)>);
}

TEST(ErrorCorpus, RepeatsAndVariesRandomScenes) {
  std::set<std::uint32_t> widths;
  int closed_forms = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const GrammarScene scene = grammar_scene(seed), same = grammar_scene(seed);
    EXPECT_EQ(scene.canvas, same.canvas);
    EXPECT_EQ(scene.scene.exact.value_or(tracer::Image{}).rgb, same.scene.exact.value_or(tracer::Image{}).rgb);
    EXPECT_TRUE(tracer::validate(scene.scene.scene, tracer::Limits{}).empty()) << seed;
    widths.insert(scene.canvas.width);
    closed_forms += scene.scene.exact ? 1 : 0;
  }
  EXPECT_GT(widths.size(), 20u);
  EXPECT_GT(closed_forms, 20);
  EXPECT_LT(closed_forms, 40);
}

/// Linear radiance times 255 in place of displayed levels: a tone curve would bias the noisy halves.
tracer::DisplayImage linear_levels(const tracer::Image& image) {
  tracer::DisplayImage linear{image.width, image.height, image.rgb};
  for (float& code : linear.codes) code *= static_cast<float>(255 * tracer::codes_per_level);
  return linear;
}

/// Compares the closed form with two images of many uniform samples.
void expect_exact(const CorpusScene& scene, const std::string& name) {
  const auto half = [&](std::uint64_t seed) {
    return linear_levels(scenes::render(reference_scene(scene.scene, 144, seed), 2, scene.assets).image);
  };
  const MeasuredError error = Truth(half(1), half(2)).error_of(linear_levels(*scene.exact));
  EXPECT_LT(error.squared, 4 * error.standard_error + 1e-3) << name;
}

TEST(ClosedForms, EqualTheLimitOfUniformSamples) {
  for (const CorpusEntry& entry : corpus()) {
    if (!entry.exact || measures_tiles(entry.settings)) continue;
    Random random(3);
    const bool long_paths = entry.settings == SettingGroup::bounds;
    expect_exact(entry.build(long_paths ? Canvas{16, 12} : Canvas{56, 48}, random), entry.family + ": " + entry.name);
  }
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    const GrammarScene random = grammar_scene(seed, {80, 70});
    if (random.scene.exact) expect_exact(random.scene, std::to_string(seed));
  }
}

}  // namespace
