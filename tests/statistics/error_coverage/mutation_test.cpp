// The statistics reject the claims of tracers, approximations and estimates with a fault, and accept those of the
// product on the same scenes with the same seeds. The samplers are those of the product.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "tests/statistics/error_coverage/trial_runner.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/sampler.h"

namespace {

using namespace error_coverage;
using namespace tracer;

using Outcome = Result<Rendered, Failure>;
using Intact = Wavefront<AllFeatures>;

/// Precondition: the scene has a target error for sample_adaptively, fixed samples for sample_uniformly.
template <auto sample, class T>
Outcome render_by(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  return sample(scene, settings, control, make<T>);
}

/// True for about one in a hundred pixels.
bool selected(std::uint64_t pixel) { return mix(pixel) % 100 == 0; }

CompiledScene without_occluders(CompiledScene scene) {
  for (CompiledLight& light : scene.lights) light.shadows = false;
  return scene;
}

/// Shadow rays of 1 % of the pixels hit no occluder.
class OmitsOccluders : public Intact {
 public:
  OmitsOccluders(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : Intact(scene, control, approximations),
        scene_(without_occluders(scene)),
        without_occluders_(scene_, control, approximations) {}

  bool trace() override {
    without_occluders_.batch() = batch();
    if (!Intact::trace() || !without_occluders_.trace()) return false;
    radiance_ = Intact::radiance();
    for (std::size_t i = 0; i < radiance_.size(); ++i) {
      const auto x = static_cast<std::uint32_t>(batch().x[i]), y = static_cast<std::uint32_t>(batch().y[i]);
      if (selected(pixel_index(scene_, x, y))) radiance_[i] = without_occluders_.radiance()[i];
    }
    return true;
  }
  [[nodiscard]] const std::vector<Color>& radiance() const override { return radiance_; }

 private:
  CompiledScene scene_;
  Intact without_occluders_;
  std::vector<Color> radiance_;
};

/// The second half of a pixel's samples repeats the first. Precondition: fixed samples.
class RepeatsHalves : public Intact {
 public:
  RepeatsHalves(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : Intact(scene, control, approximations), count_(scene.accuracy.samples) {}

  bool trace() override {
    for (std::size_t i = 0; i < batch().samples.size(); ++i) {
      Batch::Sample& sample = batch().samples[i];
      sample.index %= count_ / 2;
      const Vec2 at = pixel_sample(sample.key, sample.index, count_);
      batch().x[i] = std::floor(batch().x[i]) + at.x;
      batch().y[i] = std::floor(batch().y[i]) + at.y;
    }
    return Intact::trace();
  }

 private:
  std::uint32_t count_;
};

double without(const ErrorEstimate& error, double part) {
  return std::sqrt(std::max(0.0, error.estimate * error.estimate - part * part));
}

/// Claims without one part of the error.
template <double ErrorEstimate::*part>
Outcome render_without_part(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  Outcome rendered = render(scene, settings, control);
  if (rendered) rendered->error.estimate = without(rendered->error, rendered->error.*part);
  return rendered;
}

/// Claims of `percent` of the estimate.
template <int percent>
Outcome render_with_scaled_claim(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  Outcome rendered = render(scene, settings, control);
  if (rendered) rendered->error.estimate *= percent / 100.0;
  return rendered;
}

/// Light of glowing surfaces is too dark by 2 %, as if the weights of both ways to sample it had that sum.
Outcome render_with_faint_emission(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  CompiledScene faulty = scene;
  for (CompiledMaterial& material : faulty.terms) material.emitted_ambient = material.emitted_ambient * 0.98;
  return render(faulty, settings, control);
}

/// Paths end after two bounces, as if Russian roulette divided by no probability, and that is not charged.
Outcome render_without_long_paths(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  CompiledScene faulty = scene;
  faulty.accuracy.max_depth = 2;
  return render_without_part<&ErrorEstimate::depth>(faulty, settings, control);
}

/// Renders of scenes of the corpus in which a fault can be seen.
struct Plan {
  std::vector<CorpusEntry> entries{};
  std::vector<double> targets{4, 1};
  std::vector<std::uint32_t> samples{};  ///< fixed ones, after the targets
  std::uint32_t placements = 5;
  Canvas canvas{};
};

CorpusEntry entry_of(const std::string& family, const std::string& name) {
  for (const CorpusEntry& entry : corpus())
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

/// All trials of the plan, in the same order for every renderer.
std::vector<Trial> trials_of(const Plan& plan, Renderer renderer) {
  std::vector<Setting> settings;
  for (const double target : plan.targets) settings.push_back({.target_error = target});
  for (const std::uint32_t count : plan.samples) settings.push_back({.samples = count});
  std::vector<Trial> trials;
  std::uint64_t seed = 1;
  for (const CorpusEntry& entry : plan.entries) {
    for (std::uint32_t placement = 0; placement < plan.placements; ++placement) {
      oracle::Random random(seed);
      const CorpusScene scene = entry.build(plan.canvas, random);
      const TrialRunner runner(entry, plan.canvas, scene, 1e6);
      for (const Setting& setting : settings)
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

void expect_rejected(const std::vector<Trial>& trials, bool rejected) {
  const ClaimStatistics statistics = statistics_of(trials);
  EXPECT_EQ(statistics.rejected(), rejected)
      << statistics.broken << " of " << statistics.trials << " claims are broken, " << statistics.disproved
      << " bounds are disproved, " << statistics.underclaimed << " claims are below a tenth of the truth";
}

void expect_caught(const Plan& plan, Renderer mutant, Renderer product = render) {
  expect_rejected(trials_of(plan, product), false);
  expect_rejected(trials_of(plan, mutant), true);
}

TEST(MutantTracer, WithoutOccludersInOnePixelOfAHundredIsCaught) {
  expect_caught({.entries = {shadow()}, .placements = 10}, render_by<sample_adaptively, OmitsOccluders>,
                render_by<sample_adaptively, Intact>);
}

TEST(MutantTracer, WithEqualHalvesIsCaught) {
  expect_caught({.entries = {checker(), shapes()}, .targets = {}, .samples = {4, 16}, .placements = 3},
                render_by<sample_uniformly, RepeatsHalves>, render_by<sample_uniformly, Intact>);
}

TEST(MutantTracer, WithPartOfTheEmissionOrWithoutLongPathsIsCaught) {
  expect_caught({.entries = {entry_of("global light", "large sphere")}, .targets = {1}}, render_with_faint_emission);
  expect_caught({.entries = {entry_of("global light", "furnace")}, .targets = {4}, .placements = 6},
                render_without_long_paths);
}

TEST(MutantClaim, OfHalfTheErrorIsCaughtAndOfTenTimesIsNotClose) {
  const CorpusEntry penumbra = entry_of("ordinary, sampled", "penumbra");
  const Plan plan{.entries = {checker(), shapes(), penumbra}, .placements = 2};
  expect_caught(plan, render_with_scaled_claim<50>);
  EXPECT_GE(statistics_of(trials_of(plan, render)).close_share(), close_share_min);
  EXPECT_LT(statistics_of(trials_of(plan, render_with_scaled_claim<1000>)).close_share(), close_share_min);
}

TEST(MutantClaim, WithoutApproximationsToneDepthOrCutoffIsCaught) {
  const auto without = [](const char* family, const char* name, std::uint32_t samples, Renderer mutant) {
    expect_caught({.entries = {entry_of(family, name)}, .targets = {}, .samples = {samples}}, mutant);
  };
  without("approximations", "shadows none, shadow of 12 pixels", 16,
          render_without_part<&ErrorEstimate::approximation>);
  without("image statistics", "scale, hot squares of 0.7 pixels", 16, render_without_part<&ErrorEstimate::tone>);
  without("path bounds", "hall of mirrors of 0.95", 16, render_without_part<&ErrorEstimate::depth>);
  without("path bounds", "hall of mirrors of 0.8", 32, render_without_part<&ErrorEstimate::cutoff>);
}

TEST(MutantClaim, OfTheImageForItsFilesIsCaught) {
  Plan plan{.entries = {entry_of("encoding", "colored discs")}, .targets = {0.25}, .placements = 2};
  std::vector<Trial> trials = trials_of(plan, render);
  expect_rejected(trials, false);
  plan.entries[0].settings = SettingGroup::targets;
  const std::vector<Trial> images = trials_of(plan, render);
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i].claimed = images[i * images.size() / trials.size()].claimed;
  expect_rejected(trials, true);
}

TEST(MutantClaim, OfTheImageForItsWorstTileIsCaught) {
  std::vector<Trial> trials =
      trials_of({.entries = {entry_of("dilution", "wheel")}, .targets = {4, 2, 1}, .placements = 2}, render);
  expect_rejected(trials, false);
  for (std::size_t i = 1; i < trials.size(); i += 2) trials[i].claimed = trials[i - 1].claimed;
  expect_rejected(trials, true);
}

}  // namespace
