// A small slice of honesty_table, the same one every time: images asked for with a target error keep their promise.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/honesty/verdict.h"
#include "tests/support/effort.h"

namespace {

using namespace honesty;

/// A scene for each way to be wrong: edges, half-shadows, refracted edges, frequencies beyond the pixels', almost
/// nothing to see.
constexpr const char* slice[] = {"ball", "wide_penumbra", "glass_ball", "checker_filtered", "wires_on_floor"};

TEST(Honesty, HoldsForASliceOfTheCorpus) {
  std::vector<Outcome> outcomes;
  print_heading(std::cout);
  for (std::size_t i = 0; i < effort::cases(std::size(slice)); ++i) {
    const Case& scene = *find(slice[i % std::size(slice)]);
    const Standard standard{reference_of(scene, {.samples = 1024, .images_min = 3, .images_max = 3}), strata_of(scene)};
    Outcome outcome{scene.name, {}, {}};
    std::uint64_t seed = 1000 * i;
    for (const double target : {4.0, 2.0})
      for (int repeated = 0; repeated < 3; ++repeated) {
        tracer::Rendered rendered = rendered_to(scene, target, ++seed, 2);
        outcome.trials.push_back(judged(scene, standard, rendered, target, seed));
        seed_bias(rendered.image, rendered_to(without_light(scene), target, seed, 2).image, seed);
        outcome.biased.push_back(judged(scene, standard, rendered, target, seed));
      }
    print(std::cout, outcome);
    outcomes.push_back(outcome);
  }
  const Verdict verdict = verdict_on(outcomes);
  print(std::cout, verdict);
  for (const std::string& sentence : verdict.broken) ADD_FAILURE() << sentence;
}

}  // namespace
