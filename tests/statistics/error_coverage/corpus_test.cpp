// The corpus: its sizes exceed the size up to which every pixel is validated, and its closed forms are correct.
#include "tests/statistics/error_coverage/corpus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/statistics/error_coverage/truth.h"
#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tracer/requirements.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/validate.h"

namespace {

using namespace error_coverage;
using oracle::Random;
using tracer::PixelState;

/// Share of the pixels that the looks of one validation fall on, if all pixels have only their pilot.
double validated_share(const Canvas& canvas) {
  std::vector<PixelState> pixels(std::size_t{canvas.width} * canvas.height);
  std::set<std::uint32_t> places;
  for (const tracer::Look& look : tracer::draw_looks(pixels, tracer::looks_min, 1, 1).looks) places.insert(look.place);
  return static_cast<double>(places.size()) / static_cast<double>(pixels.size());
}

TEST(ErrorCorpus, LeavesPixelsOutOfEveryValidation) {
  for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) {
    Random random(1);
    const tracer::ImageSize image = entry.build({160, 120}, random).scene.image;
    EXPECT_LT(validated_share({image.width, image.height}), 0.15) << entry.family << ": " << entry.name;
  }
  EXPECT_LT(validated_share({320, 240}), 0.05);
  EXPECT_LT(validated_share({1280, 720}), 0.05);
}

TEST(ErrorCorpus, LeavesPixelsOutOfEveryRandomScene) {
  double share = 0;
  constexpr int count = 50;
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    const double of_one = validated_share(grammar_scene(seed, {640, 480}).canvas);
    EXPECT_LT(of_one, 0.6) << seed;
    share += of_one / count;
  }
  EXPECT_LT(share, 0.25);
}

TEST(ErrorCorpus, HasValidScenesWithExactImagesOfTheirSize) {
  std::set<std::string> names;
  for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) {
    SCOPED_TRACE(entry.family + ": " + entry.name);
    EXPECT_TRUE(names.insert(entry.family + entry.name).second);
    Random random(2);
    const CorpusScene scene = entry.build({160, 120}, random);
    const auto issues = tracer::validate(scene.scene, tracer::Limits{});
    EXPECT_TRUE(issues.empty()) << issues[0].pointer << ": " << issues[0].detail;
    EXPECT_EQ(scene.exact.has_value(), entry.exact);
    if (scene.exact) {
      EXPECT_EQ(scene.exact->width, scene.scene.image.width);
    }
  }
}

/// Scenes of all entries, at 160 x 120.
const std::vector<tracer::Scene>& all_scenes() {
  static const std::vector<tracer::Scene> scenes = [] {
    std::vector<tracer::Scene> built;
    for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) {
      Random random(1);
      built.push_back(entry.build({160, 120}, random).scene);
    }
    return built;
  }();
  return scenes;
}

TEST(ErrorCorpus, HasEveryRequirement) {
  for (const tracer::RequirementName& requirement : tracer::requirement_names) {
    if (requirement.needed == &tracer::Requirements::layers) continue;  // the runner requests them
    // ModelError compares approximated light between surfaces with references.
    if (requirement.needed == &tracer::Requirements::interreflection) continue;
    EXPECT_TRUE(std::ranges::any_of(all_scenes(), [&](const tracer::Scene& scene) {
      return requirements(scene).*requirement.needed;
    })) << requirement.name;
  }
}

/// Alternatives 0 .. count - 1 that no scene of the corpus has; `add` inserts those of one scene.
using Alternatives = std::set<std::size_t>;
template <class Add>
Alternatives missing(std::size_t count, const Add& add) {
  Alternatives found, result;
  for (const tracer::Scene& scene : all_scenes()) add(scene, found);
  for (std::size_t i = 0; i < count; ++i)
    if (!found.contains(i)) result.insert(i);
  return result;
}

template <class Enum>
std::size_t index_of(Enum value) {
  return static_cast<std::size_t>(value);
}

TEST(ErrorCorpus, HasEveryShapeLightAndTexture) {
  const auto add_shapes = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Object& object : scene.objects) found.insert(object.shape.index());
  };
  const auto add_lights = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Light& light : scene.lights) found.insert(light.source.index());
  };
  const auto add_attenuations = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Light& light : scene.lights) found.insert(index_of(light.attenuation.kind));
  };
  const auto add_textures = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Texture& texture : scene.textures) found.insert(texture.pattern.index());
  };
  EXPECT_EQ(missing(std::variant_size_v<tracer::Shape>, add_shapes), Alternatives{});
  EXPECT_EQ(missing(std::variant_size_v<tracer::LightSource>, add_lights), Alternatives{});
  EXPECT_EQ(missing(3, add_attenuations), Alternatives{});
  EXPECT_EQ(missing(std::variant_size_v<decltype(tracer::Texture::pattern)>, add_textures), Alternatives{});
}

TEST(ErrorCorpus, HasEveryMaterialCameraBackgroundAndOverflow) {
  const auto add_models = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Material& material : scene.materials) found.insert(index_of(material.model));
  };
  const auto add_transparencies = [](const tracer::Scene& scene, Alternatives& found) {
    for (const tracer::Material& material : scene.materials) found.insert(index_of(material.transparency));
  };
  const auto add_cameras = [](const tracer::Scene& scene, Alternatives& found) {
    found.insert(index_of(scene.camera.type));
  };
  const auto add_backgrounds = [](const tracer::Scene& scene, Alternatives& found) {
    const tracer::Background& background = scene.background;
    found.insert(background.cube ? 0 : background.environment ? 1 : background.gradient ? 2 : 3);
  };
  const auto add_overflows = [](const tracer::Scene& scene, Alternatives& found) {
    found.insert(index_of(scene.output.overflow));
  };
  EXPECT_EQ(missing(3, add_models), Alternatives{});
  EXPECT_EQ(missing(3, add_transparencies), Alternatives{});
  EXPECT_EQ(missing(3, add_cameras), Alternatives{});
  EXPECT_EQ(missing(4, add_backgrounds), Alternatives{});
  EXPECT_EQ(missing(3, add_overflows), Alternatives{});
}

TEST(ErrorCorpus, RepeatsAndVariesRandomScenes) {
  const GrammarScene a = grammar_scene(7, {160, 120}), same = grammar_scene(7, {160, 120});
  EXPECT_EQ(a.canvas, same.canvas);
  EXPECT_EQ(a.scene.exact.has_value(), same.scene.exact.has_value());
  if (a.scene.exact) {
    EXPECT_EQ(a.scene.exact->rgb, same.scene.exact->rgb);
  }
  std::set<std::uint32_t> widths;
  std::uint32_t closed_forms = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const GrammarScene scene = grammar_scene(seed, {160, 120});
    EXPECT_TRUE(tracer::validate(scene.scene.scene, tracer::Limits{}).empty()) << seed;
    widths.insert(scene.canvas.width);
    closed_forms += scene.scene.exact ? 1 : 0;
  }
  EXPECT_GT(widths.size(), 20u);
  EXPECT_GT(closed_forms, 20u);
  EXPECT_LT(closed_forms, 40u);
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
  for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) {
    if (!entry.exact || measures_tiles(entry.settings)) continue;
    Random random(3);
    const bool long_paths = entry.settings == SettingGroup::bounds;
    expect_exact(entry.build(long_paths ? Canvas{16, 12} : Canvas{56, 48}, random), entry.family + ": " + entry.name);
  }
}

/// One sample in eighty finds the lamp: only the mean of many shows whether all of it is in sight.
TEST(ClosedForms, OfALampInAMirrorHasTheMeanOfManySamples) {
  const auto entries = global_entries();
  const auto entry = std::ranges::find(entries, "lamp in a mirror alone", &CorpusEntry::name);
  ASSERT_NE(entry, entries.end());
  Random random(3);
  const CorpusScene scene = entry->build({16, 12}, random);
  const tracer::Image image = scenes::render(reference_scene(scene.scene, 16'384, 1), 2, scene.assets).image;
  double sum = 0, squares = 0, exact = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    const double difference = image.rgb[i] - scene.exact->rgb[i];
    sum += difference;
    squares += difference * difference;
    exact += scene.exact->rgb[i];
  }
  EXPECT_LT(std::sqrt(squares), 0.01 * exact);  // the test can find a missing hundredth
  EXPECT_LT(std::abs(sum), 3 * std::sqrt(squares));
}

TEST(ClosedForms, EqualTheLimitOfUniformSamplesInRandomScenes) {
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    const GrammarScene random = grammar_scene(seed, {80, 70});
    if (random.scene.exact) expect_exact(random.scene, std::to_string(seed));
  }
}

}  // namespace
