#pragma once
/// Summary of many trials: coverage and calibration of the error estimates.

#include <iosfwd>
#include <string>
#include <vector>

#include "tests/statistics/binomial.h"
#include "tests/statistics/trial.h"

namespace statistics {

/// Trials of one scene: for each target, from the largest to the smallest, all seeds.
struct SceneTrials {
  std::string scene;
  std::vector<Trial> trials;
  /// Trials of images in which one pixel of a hundred lacks a light; empty if the scene has no light.
  std::vector<Trial> biased;
};

/// Trials of one scene with one target. Errors are in code values.
struct TrialSummary {
  std::string scene;
  double target = 0;
  double estimated = 0;   ///< mean over the seeds
  double true_error = 0;  ///< root mean square over the seeds
  double spread = 0;      ///< standard deviation of the true error over the seeds; 0 for one seed
  double reference_error = 0, samples_per_pixel = 0;
  std::size_t seeds = 0, targets_reached = 0;
  bool coarse = false;  ///< the reference is coarse for at least one trial
  Coverage coverage;
};
std::vector<TrialSummary> summarize(const SceneTrials& scene_trials);

/// Targets with a larger true error than the next larger target, by more than 4 standard errors of the difference,
/// which follow from the relative spread over the seeds of all targets. Targets with fewer than 3 seeds are skipped.
std::vector<std::string> find_increases(const std::vector<TrialSummary>& summaries);

/// Classes with fewer pixels in a scene are not tested there: all of them may by chance be worse than estimated.
inline constexpr std::size_t class_pixels_min = 30;

struct CoverageReport {
  Coverage images;  ///< over all scenes
  std::array<Coverage, pixel_class_names.size()> pixel_classes;
  std::array<double, pixel_class_names.size()> class_ratio{};  ///< geometric mean of true over estimated error
  Coverage biased;                                             ///< over the images with the injected bias
  std::uint64_t biased_scenes = 0, detected_scenes = 0;
  std::uint64_t trials = 0, calibrated = 0;
  std::uint64_t targets_reached = 0, coarse = 0;
  double confidence = 1;
  std::vector<std::string> failures;  ///< criteria that do not hold, one sentence each
};

/// `calibrated_min`: smallest part of the trials that must be calibrated.
CoverageReport report_coverage(const std::vector<SceneTrials>& scenes, double calibrated_min = 0.9);

void print_heading(std::ostream& out);
void print(std::ostream& out, const SceneTrials& scene_trials);
void print(std::ostream& out, const CoverageReport& report);
/// Writes every trial as JSON.
void write_json(std::ostream& out, const std::vector<SceneTrials>& scenes, const CoverageReport& report);

}  // namespace statistics
