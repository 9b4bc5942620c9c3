#pragma once
/// What many trials say together: whether the estimates of error can be trusted.

#include <iosfwd>
#include <string>
#include <vector>

#include "tests/honesty/statistics.h"
#include "tests/honesty/trial.h"

namespace honesty {

/// A scene's trials: all targets from the largest to the smallest, and of each all seeds.
struct Outcome {
  std::string scene;
  std::vector<Trial> trials;
  /// Likewise, of images in which one light is missing from a pixel of a hundred; empty: the scene has no light.
  std::vector<Trial> biased;
};

/// Trials of one scene with one target.
struct Row {
  std::string scene;
  double target = 0, claimed = 0;  ///< the mean claim
  double truth = 0;                ///< root mean square over the seeds, as is what follows
  double spread = 0;               ///< standard deviation of one seed's truth; 0 for one seed
  double reference_error = 0, samples_per_pixel = 0;
  std::size_t seeds = 0, met = 0;
  bool coarse = false;  ///< the reference is for one of them
  Coverage coverage;
};
std::vector<Row> rows_of(const Outcome& outcome);

/// Targets at which the true error is larger than at the next larger target by more than its noise: 4 standard errors
/// of the difference, from the relative spread over the seeds of all targets. Nothing is said of fewer than 3 seeds.
std::vector<std::string> growths(const std::vector<Row>& rows);

/// A stratum's claims and those of the whole images differ in one thing: few pixels of a stratum may by chance all
/// be worse than claimed. Strata of fewer pixels in a scene are not judged there.
inline constexpr std::size_t stratum_pixels_min = 30;

struct Verdict {
  Coverage images;  ///< over all scenes
  std::array<Coverage, stratum_names.size()> strata;
  std::array<double, stratum_names.size()> strata_ratio{};  ///< geometric mean of true/claimed
  Coverage biased;                                          ///< of the images with the seeded bias
  std::uint64_t biased_scenes = 0, caught_scenes = 0;
  std::uint64_t trials = 0, close = 0;  ///< with true/claimed in [0.4, 1.05]
  std::uint64_t met = 0, coarse = 0;
  double confidence = 1;
  std::vector<std::string> broken;  ///< criteria, a sentence each; empty: the tracer is honest
};

/// `close_wanted`: the part of the trials that must be close.
Verdict verdict_on(const std::vector<Outcome>& outcomes, double close_wanted = 0.9);

void print_heading(std::ostream& out);
void print(std::ostream& out, const Outcome& outcome);
void print(std::ostream& out, const Verdict& verdict);
/// Every trial, for programs.
void write_json(std::ostream& out, const std::vector<Outcome>& outcomes, const Verdict& verdict);

}  // namespace honesty
