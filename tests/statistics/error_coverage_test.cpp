// A fixed sample of coverage_table: the error estimates of adaptive images cover the true errors.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/statistics/coverage_report.h"
#include "tests/support/effort.h"

namespace {

using namespace statistics;

/// One scene for each cause of error: edges, penumbrae, refraction, texture frequencies beyond the pixels', features
/// thinner than a pixel.
constexpr const char* sample_scenes[] = {"ball", "wide_penumbra", "glass_ball", "checker_filtered", "wires_on_floor"};

TEST(ErrorEstimate, CoversTheTrueErrorOfASampleOfTheCorpus) {
  std::vector<SceneTrials> scenes;
  print_heading(std::cout);
  for (std::size_t i = 0; i < effort::cases(std::size(sample_scenes)); ++i) {
    const Case& scene = *find(sample_scenes[i % std::size(sample_scenes)]);
    const GroundTruth ground_truth{compute_reference(scene, {.samples = 1024, .images_min = 3, .images_max = 3}),
                                   classify_pixels(scene)};
    SceneTrials scene_trials{scene.name, {}, {}};
    std::uint64_t seed = 1000 * i;
    for (const double target : {4.0, 2.0})
      for (int repeated = 0; repeated < 3; ++repeated) {
        tracer::Rendered rendered = render_to_target(scene, target, ++seed, 2);
        scene_trials.trials.push_back(evaluate(scene, ground_truth, rendered, target, seed));
        inject_bias(rendered.image, render_to_target(without_light(scene), target, seed, 2).image, seed);
        scene_trials.biased.push_back(evaluate(scene, ground_truth, rendered, target, seed));
      }
    print(std::cout, scene_trials);
    scenes.push_back(scene_trials);
  }
  const CoverageReport report = report_coverage(scenes);
  print(std::cout, report);
  for (const std::string& sentence : report.failures) ADD_FAILURE() << sentence;
}

}  // namespace
