#include "tests/statistics/coverage_report.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace statistics {
namespace {

/// Relative standard deviation of the true error over the seeds, root mean square over the summaries.
double relative_spread(const std::vector<TrialSummary>& summaries) {
  double squares = 0, count = 0;
  for (const TrialSummary& summary : summaries) {
    if (summary.true_error == 0) continue;
    squares += summary.spread * summary.spread / (summary.true_error * summary.true_error);
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

struct GeometricMean {
  double logarithms = 0, count = 0;
  void add(double value) { logarithms += std::log(value), ++count; }
  [[nodiscard]] double value() const { return count > 0 ? std::exp(logarithms / count) : 0; }
};
using ClassRatios = std::array<GeometricMean, pixel_class_names.size()>;

void add_scene(const SceneTrials& scene_trials, CoverageReport& report, ClassRatios& ratios) {
  Coverage coverage, biased;
  for (const Trial& trial : scene_trials.trials) {
    report.confidence = std::min(report.confidence, trial.error.confidence);
    coverage.add(trial.covered());
    report.images.add(trial.covered());
    ++report.trials;
    report.calibrated += trial.calibrated() ? 1 : 0;
    report.targets_reached += trial.error.target_met ? 1 : 0;
    report.coarse += trial.reference_is_coarse() ? 1 : 0;
    for (std::size_t s = 0; s < trial.pixel_classes.size(); ++s)
      if (const ClassError& part = trial.pixel_classes[s]; part.pixels >= class_pixels_min) {
        report.pixel_classes[s].add(part.true_error <=
                                    part.estimated + (trial.reference_is_coarse() ? trial.reference_error : 0));
        if (part.true_error > 0 && part.estimated > 0) ratios[s].add(part.true_error / part.estimated);
      }
    if (trial.error.target_met != (!trial.error.target || trial.error.estimate <= *trial.error.target))
      report.failures.push_back(scene_trials.scene + ": `target_met` contradicts the estimate");
  }
  if (coverage.rejected(report.confidence))
    report.failures.push_back(scene_trials.scene + ": " + std::to_string(coverage.misses) + " of " +
                              std::to_string(coverage.trials) + " error estimates are too small");
  for (const std::string& increase : find_increases(summarize(scene_trials))) report.failures.push_back(increase);
  for (const Trial& trial : scene_trials.biased) {
    biased.add(trial.covered());
    report.biased.add(trial.covered());
  }
  report.biased_scenes += scene_trials.biased.empty() ? 0 : 1;
  report.detected_scenes += biased.rejected(report.confidence) ? 1 : 0;
}

std::string percent(double part) {
  std::ostringstream text;
  text.precision(3);
  text << 100 * part << " %";
  return text.str();
}

}  // namespace

std::vector<TrialSummary> summarize(const SceneTrials& scene_trials) {
  std::vector<TrialSummary> summaries;
  for (const Trial& trial : scene_trials.trials) {
    if (summaries.empty() || summaries.back().target != trial.target) {
      summaries.emplace_back();
      summaries.back().scene = scene_trials.scene;
      summaries.back().target = trial.target;
      summaries.back().reference_error = trial.reference_error;
    }
    TrialSummary& summary = summaries.back();
    ++summary.seeds;
    summary.estimated += trial.error.estimate;
    summary.true_error += trial.true_error * trial.true_error;
    summary.spread += trial.true_error;  // the sum; the deviation once the mean is known
    summary.samples_per_pixel += trial.samples_per_pixel;
    summary.targets_reached += trial.error.target_met ? 1 : 0;
    summary.coarse |= trial.reference_is_coarse();
    summary.coverage.add(trial.covered());
  }
  for (TrialSummary& summary : summaries) {
    const auto count = static_cast<double>(summary.seeds);
    const double mean = summary.spread / count;
    summary.estimated /= count;
    summary.samples_per_pixel /= count;
    summary.spread =
        summary.seeds < 2 ? 0 : std::sqrt(std::max(0.0, summary.true_error - count * mean * mean) / (count - 1));
    summary.true_error = std::sqrt(summary.true_error / count);
  }
  return summaries;
}

std::vector<std::string> find_increases(const std::vector<TrialSummary>& summaries) {
  std::vector<std::string> found;
  const double spread = relative_spread(summaries);
  for (std::size_t i = 1; i < summaries.size(); ++i) {
    const TrialSummary &coarser = summaries[i - 1], &finer = summaries[i];
    if (std::min(coarser.seeds, finer.seeds) < 3) continue;
    const double noise = spread * std::hypot(coarser.true_error / std::sqrt(static_cast<double>(coarser.seeds)),
                                             finer.true_error / std::sqrt(static_cast<double>(finer.seeds)));
    if (finer.true_error <= coarser.true_error + 4 * noise + finer.reference_error) continue;
    std::ostringstream text;
    text << finer.scene << ": the error grows from " << coarser.true_error << " to " << finer.true_error
         << " as the target falls from " << coarser.target << " to " << finer.target;
    found.push_back(text.str());
  }
  return found;
}

CoverageReport report_coverage(const std::vector<SceneTrials>& scenes, double calibrated_min) {
  CoverageReport report;
  ClassRatios ratios;
  for (const SceneTrials& scene_trials : scenes) add_scene(scene_trials, report, ratios);
  for (std::size_t s = 0; s < ratios.size(); ++s) report.class_ratio[s] = ratios[s].value();
  const auto part = [](std::uint64_t some, std::uint64_t all) {
    return all == 0 ? 0 : static_cast<double>(some) / static_cast<double>(all);
  };
  if (report.trials == 0) report.failures.emplace_back("there are no trials");
  if (report.images.rejected(report.confidence))
    report.failures.push_back("images: " + percent(part(report.images.misses, report.images.trials)) +
                              " of the error estimates are too small");
  for (std::size_t s = 0; s < pixel_class_names.size(); ++s)
    if (report.pixel_classes[s].rejected(report.confidence))
      report.failures.push_back("pixels of class " + std::string(pixel_class_names[s]) + ": " +
                                percent(part(report.pixel_classes[s].misses, report.pixel_classes[s].trials)) +
                                " of the error estimates are too small");
  if (part(report.calibrated, report.trials) < calibrated_min)
    report.failures.push_back("only " + percent(part(report.calibrated, report.trials)) +
                              " of the error estimates are calibrated, not " + percent(calibrated_min));
  if (report.biased.trials > 0 && !report.biased.rejected(report.confidence))
    report.failures.emplace_back("the injected bias is not detected");
  return report;
}

}  // namespace statistics
