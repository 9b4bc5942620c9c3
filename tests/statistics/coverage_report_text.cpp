#include <cmath>
#include <iomanip>
#include <iostream>

#include "tests/statistics/coverage_report.h"

namespace statistics {
namespace {

constexpr int name_width = 18;

std::ostream& number(std::ostream& out, double value, int width = 9) {
  return out << std::setw(width) << std::fixed << std::setprecision(3) << value;
}

void print(std::ostream& out, std::string_view name, const Coverage& coverage, double confidence, double ratio = 0) {
  out << "  " << std::left << std::setw(name_width) << name << std::right << std::setw(6) << coverage.trials
      << " estimates" << std::setw(6) << coverage.misses << " too small; "
      << (coverage.rejected(confidence) ? "REJECTED" : "not rejected");
  if (ratio > 0) number(out << "; mean true/estimated", ratio, 6);
  out << "\n";
}

}  // namespace

void print_heading(std::ostream& out) {
  out << std::left << std::setw(name_width) << "scene" << std::right << std::setw(7) << "target" << std::setw(10)
      << "estimated" << std::setw(9) << "true" << std::setw(9) << "ratio" << std::setw(7) << "met" << std::setw(11)
      << "samples" << std::setw(9) << "covered"
      << "   [code values; ~: error of the reference]\n";
}

void print(std::ostream& out, const SceneTrials& scene_trials) {
  for (const TrialSummary& summary : summarize(scene_trials)) {
    out << std::left << std::setw(name_width) << summary.scene << std::right << std::setw(7) << std::defaultfloat
        << summary.target;
    number(out, summary.estimated, 10);
    number(out, summary.true_error);
    number(out, summary.estimated > 0 ? summary.true_error / summary.estimated : summary.true_error > 0 ? INFINITY : 1);
    out << std::setw(5) << summary.targets_reached << "/" << summary.seeds;
    number(out, summary.samples_per_pixel, 11);
    out << std::setw(7) << summary.coverage.trials - summary.coverage.misses << "/" << summary.seeds;
    if (summary.coarse) number(out << "  ~", summary.reference_error, 0);
    out << "\n";
  }
  out << std::flush;
}

void print(std::ostream& out, const CoverageReport& report) {
  out << "\nat a confidence of " << std::defaultfloat << report.confidence
      << ", rejecting counts with a probability below " << static_cast<double>(significance) << ":\n";
  print(out, "images", report.images, report.confidence);
  for (std::size_t s = 0; s < pixel_class_names.size(); ++s)
    print(out, pixel_class_names[s], report.pixel_classes[s], report.confidence, report.class_ratio[s]);
  if (report.biased.trials > 0) {
    print(out, "injected bias", report.biased, report.confidence);
    out << "  the injected bias is detected in " << report.detected_scenes << " of " << report.biased_scenes
        << " single scenes\n";
  }
  out << "  true/estimated in [0.4, 1.05]: " << report.calibrated << " of " << report.trials
      << "; targets reached: " << report.targets_reached << "; coarse references: " << report.coarse << "\n";
  for (const std::string& sentence : report.failures) out << "FAILED  " << sentence << "\n";
  out << (report.failures.empty() ? "all criteria hold" : std::to_string(report.failures.size()) + " criteria failed")
      << std::endl;
}

void write_json(std::ostream& out, const std::vector<SceneTrials>& scenes, const CoverageReport& report) {
  out << std::defaultfloat << std::setprecision(9) << "{\"confidence\": " << report.confidence
      << ", \"passed\": " << (report.failures.empty() ? "true" : "false") << ", \"trials\": [";
  const char* between = "\n";
  const auto write = [&](const std::string& scene, const Trial& trial, bool biased) {
    out << between << R"({"scene": ")" << scene << R"(", "biased": )" << (biased ? "true" : "false")
        << ", \"target\": " << trial.target << ", \"seed\": " << trial.seed
        << ", \"estimated\": " << trial.error.estimate << ", \"sampling\": " << trial.error.sampling
        << ", \"depth\": " << trial.error.depth << ", \"cutoff\": " << trial.error.cutoff
        << ", \"true\": " << trial.true_error << ", \"reference_error\": " << trial.reference_error
        << ", \"target_met\": " << (trial.error.target_met ? "true" : "false")
        << ", \"samples_per_pixel\": " << trial.samples_per_pixel << ", \"pixel_classes\": {";
    for (std::size_t s = 0; s < pixel_class_names.size(); ++s)
      out << (s > 0 ? ", " : "") << '"' << pixel_class_names[s] << R"(": {"pixels": )" << trial.pixel_classes[s].pixels
          << ", \"true\": " << trial.pixel_classes[s].true_error
          << ", \"estimated\": " << trial.pixel_classes[s].estimated << "}";
    out << "}}";
    between = ",\n";
  };
  for (const SceneTrials& scene_trials : scenes) {
    for (const Trial& trial : scene_trials.trials) write(scene_trials.scene, trial, false);
    for (const Trial& trial : scene_trials.biased) write(scene_trials.scene, trial, true);
  }
  out << "\n]}\n";
}

}  // namespace statistics
