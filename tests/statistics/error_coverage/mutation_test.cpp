// The statistics reject the claims of tracers, intervals, looks and estimates with a fault, and accept those of the
// product on the same scenes with the same seeds.
//
// Three faults of looks cannot be seen in claims and are left to the tests of LookPool. Repaired pixels that leave the
// pool: few renders repair any. No looks at all: the estimate then contains what looks would have excluded. A proof
// that starts again with its whole alpha: its bound is far from tight.
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/statistics/error_coverage/mutants.h"
#include "tests/statistics/error_coverage/trial_runner.h"

namespace {

using namespace error_coverage;
using namespace error_coverage::mutants;
using tracer::ErrorEstimate;

/// Renders of scenes of the corpus in which a fault can be seen.
struct Plan {
  std::vector<CorpusEntry> entries{};
  std::vector<double> targets{4, 1};
  std::vector<std::uint32_t> samples{};  ///< fixed ones, after the targets
  std::uint32_t placements = 5;
  Canvas canvas{};

  [[nodiscard]] std::vector<Setting> settings() const {
    std::vector<Setting> list;
    for (const double target : targets) list.push_back({.target_error = target});
    for (const std::uint32_t count : samples) list.push_back({.samples = count});
    return list;
  }
};

CorpusEntry entry_of(const std::string& family, const std::string& name) {
  for (const auto& entries : {display_entries(), feature_entries(), ordinary_entries(), global_entries()})
    for (const CorpusEntry& entry : entries)
      if (entry.family == family && entry.name == name) return entry;
  throw std::runtime_error(family + ": " + name + " is not in the corpus");
}

/// A square of shadow with a side of 12 pixels, without approximations.
CorpusEntry shadow() {
  CorpusEntry entry = entry_of("approximations", "shadows none, shadow of 12 pixels");
  entry.build = [build = entry.build](Canvas canvas, oracle::Random& random) {
    CorpusScene scene = build(canvas, random);
    scene.scene.accuracy.approximate = {};
    return scene;
  };
  return entry;
}
CorpusEntry checker() { return entry_of("ordinary, closed form", "checker"); }
CorpusEntry shapes() { return entry_of("ordinary, closed form", "shapes on a gradient"); }
CorpusEntry triangles() { return entry_of("thin meshes", "200 faint triangles of 0.04 pixels"); }

/// All trials of the plan, in the same order for every renderer.
std::vector<Trial> trials_of(const Plan& plan, Renderer renderer) {
  std::vector<Trial> trials;
  std::uint64_t seed = 1;
  for (const CorpusEntry& entry : plan.entries) {
    for (std::uint32_t placement = 0; placement < plan.placements; ++placement) {
      oracle::Random random(seed);
      const CorpusScene scene = entry.build(plan.canvas, random);
      const TrialRunner runner(entry, plan.canvas, scene, {.samples = 1e6, .threads = 2, .directory = {}});
      for (const Setting& setting : plan.settings())
        for (const Trial& trial : runner.run(setting, ++seed, renderer)) trials.push_back(trial);
    }
  }
  return trials;
}

ClaimStatistics statistics_of(const std::vector<Trial>& trials) {
  ClaimStatistics statistics;
  for (const Trial& trial : trials) statistics.add(trial);
  return statistics;
}

std::string text(const ClaimStatistics& statistics) {
  return std::to_string(statistics.broken) + " of " + std::to_string(statistics.trials) + " claims are broken, " +
         std::to_string(statistics.disproved) + " bounds are disproved, " + std::to_string(statistics.underclaimed) +
         " claims are below a tenth of the truth";
}

void expect_accepted(const std::vector<Trial>& trials) {
  const ClaimStatistics statistics = statistics_of(trials);
  EXPECT_FALSE(statistics.rejected()) << text(statistics);
}

void expect_rejected(const std::vector<Trial>& trials) {
  const ClaimStatistics statistics = statistics_of(trials);
  EXPECT_TRUE(statistics.rejected()) << text(statistics);
}

void expect_caught(const Plan& plan, std::initializer_list<Renderer> mutants) {
  expect_accepted(trials_of(plan, tracer::render));
  for (std::size_t i = 0; i < mutants.size(); ++i) {
    SCOPED_TRACE("mutant " + std::to_string(i));
    expect_rejected(trials_of(plan, mutants.begin()[i]));
  }
}

TEST(Mutant, WithoutAFaultHasTheClaimsAndErrorsOfTheProduct) {
  const auto expect_equal = [](const Plan& plan, Renderer renderer) {
    const std::vector<Trial> product = trials_of(plan, tracer::render), mutant = trials_of(plan, renderer);
    for (std::size_t i = 0; i < product.size(); ++i) {
      EXPECT_EQ(product[i].claimed, mutant[i].claimed);
      EXPECT_EQ(product[i].error.squared, mutant[i].error.squared);
    }
  };
  expect_equal({.entries = {shapes()}, .targets = {2}, .placements = 2}, render_adaptively<Intact>);
  expect_equal({.entries = {shapes()}, .targets = {}, .samples = {4}, .placements = 2}, render_uniformly<Intact>);
}

TEST(MutantTracer, WithoutOccludersInOnePixelOfAHundredIsCaught) {
  expect_caught({.entries = {shadow()}, .placements = 10},
                {render_adaptively<OmitsOccluders<Samples::all>>, render_adaptively<OmitsOccluders<Samples::pilots>>});
}

TEST(MutantTracer, WithEqualHalvesIsCaught) {
  const Plan adaptive{.entries = {checker(), shapes()}, .placements = 3};
  Plan fixed = adaptive;
  fixed.targets = {};
  fixed.samples = {4, 16};
  expect_caught(adaptive, {render_adaptively<RepeatsHalves>});
  expect_caught(fixed, {render_uniformly<RepeatsHalves>});
}

TEST(MutantTracer, WithPartOfTheEmissionOrWithoutLongPathsIsCaught) {
  const CorpusEntry lamp = entry_of("global light", "large sphere"), room = entry_of("global light", "furnace");
  expect_caught({.entries = {lamp}, .targets = {1}}, {render_with_scaled_emission<0>, render_with_scaled_emission<98>});
  expect_caught({.entries = {room}, .targets = {4}, .placements = 6}, {render_without_long_paths<2>});
}

TEST(MutantInterval, WithoutOccludersIsCaught) {
  expect_caught({.entries = {shadow()}}, {render_adaptively<BoundsWithoutOccluders>});
}

TEST(MutantInterval, OfOneSurfaceInOnePixelOfAHundredIsCaught) {
  expect_caught({.entries = {checker()}, .targets = {1, 0.5}}, {render_adaptively<BoundsOfOneSurface<100>>});
}

TEST(MutantInterval, WithoutSmallMeshesIsCaught) {
  expect_caught({.entries = {triangles()}}, {render_adaptively<BoundsOfOneSurface<1>>});
}

TEST(MutantInterval, OfApproximationsInPlaceOfTheExactImageIsCaught) {
  expect_caught({.entries = {entry_of("approximations", "shadows none, shadow of 4 pixels")}, .canvas = {320, 240}},
                {render_adaptively<BoundsOfApproximations>});
}

TEST(MutantLooks, WithoutFindsOrWithEqualProbabilitiesAreCaught) {
  const CorpusEntry square = entry_of("bright specks", "square of 4 pixels on a gradient");
  expect_caught({.entries = {square}, .targets = {4}, .placements = 8, .canvas = {320, 240}},
                {render_adaptively<Intact, LooksWithoutFinds>, render_adaptively<Intact, UniformLooks>});
}

TEST(MutantClaim, OfHalfTheErrorIsCaught) {
  const CorpusEntry penumbra = entry_of("ordinary, sampled", "penumbra");
  expect_caught({.entries = {checker(), shapes(), penumbra}, .placements = 2}, {render_with_scaled_claim<50>});
}

TEST(MutantClaim, OfTenTimesTheErrorIsNotClose) {
  const Plan plan{.entries = {triangles()}};
  EXPECT_GE(statistics_of(trials_of(plan, tracer::render)).close_share(), close_share_min);
  EXPECT_LT(statistics_of(trials_of(plan, render_with_scaled_claim<1000>)).close_share(), close_share_min);
}

TEST(MutantClaim, WithoutApproximationsIsCaught) {
  expect_caught({.entries = {entry_of("approximations", "shadows none, shadow of 12 pixels")}, .placements = 3},
                {render_without_part<&ErrorEstimate::approximation>});
}

TEST(MutantClaim, WithoutToneIsCaught) {
  expect_caught({.entries = {entry_of("image statistics", "scale, hot squares of 0.7 pixels")},
                 .targets = {},
                 .samples = {16, 32}},
                {render_without_part<&ErrorEstimate::tone>});
}

TEST(MutantClaim, WithoutDepthOrCutoffIsCaught) {
  expect_caught({.entries = {entry_of("path bounds", "hall of mirrors of 0.95")},
                 .targets = {},
                 .samples = {16},
                 .placements = 3},
                {render_without_part<&ErrorEstimate::depth>});
  expect_caught(
      {.entries = {entry_of("path bounds", "hall of mirrors of 0.8")}, .targets = {}, .samples = {32}, .placements = 3},
      {render_without_part<&ErrorEstimate::cutoff>});
}

TEST(MutantClaim, OfTheImageForItsFilesIsCaught) {
  Plan plan{.entries = {entry_of("encoding", "colored discs")}, .targets = {0.25}, .placements = 2};
  std::vector<Trial> trials = trials_of(plan, tracer::render);
  expect_accepted(trials);
  plan.entries[0].settings = SettingGroup::targets;
  const std::vector<Trial> images = trials_of(plan, tracer::render);
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i].claimed = images[i * images.size() / trials.size()].claimed;
  expect_rejected(trials);
}

TEST(MutantClaim, OfTheImageForItsWorstTileIsCaught) {
  std::vector<Trial> trials =
      trials_of({.entries = {entry_of("dilution", "wheel")}, .targets = {4, 2, 1}, .placements = 2}, tracer::render);
  expect_accepted(trials);
  for (std::size_t i = 1; i < trials.size(); i += 2) trials[i].claimed = trials[i - 1].claimed;
  expect_rejected(trials);
}

}  // namespace
