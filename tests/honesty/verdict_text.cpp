#include <cmath>
#include <iomanip>
#include <iostream>

#include "tests/honesty/verdict.h"

namespace honesty {
namespace {

constexpr int name_width = 18;

std::ostream& number(std::ostream& out, double value, int width = 9) {
  return out << std::setw(width) << std::fixed << std::setprecision(3) << value;
}

void print(std::ostream& out, std::string_view name, const Coverage& coverage, double confidence, double ratio = 0) {
  out << "  " << std::left << std::setw(name_width) << name << std::right << std::setw(6) << coverage.trials
      << " claims" << std::setw(6) << coverage.misses << " broken; "
      << (coverage.rejected(confidence) ? "REJECTED" : "not rejected");
  if (ratio > 0) number(out << "; true/claimed in the mean", ratio, 6);
  out << "\n";
}

}  // namespace

void print_heading(std::ostream& out) {
  out << std::left << std::setw(name_width) << "scene" << std::right << std::setw(7) << "target" << std::setw(9)
      << "claimed" << std::setw(9) << "true" << std::setw(9) << "ratio" << std::setw(7) << "met" << std::setw(11)
      << "samples" << std::setw(7) << "kept"
      << "   [levels; ~: reference's own error]\n";
}

void print(std::ostream& out, const Outcome& outcome) {
  for (const Row& row : rows_of(outcome)) {
    out << std::left << std::setw(name_width) << row.scene << std::right << std::setw(7) << std::defaultfloat
        << row.target;
    number(out, row.claimed);
    number(out, row.truth);
    number(out, row.claimed > 0 ? row.truth / row.claimed : row.truth > 0 ? INFINITY : 1);
    out << std::setw(5) << row.met << "/" << row.seeds;
    number(out, row.samples_per_pixel, 11);
    out << std::setw(5) << row.coverage.trials - row.coverage.misses << "/" << row.seeds;
    if (row.coarse) number(out << "  ~", row.reference_error, 0);
    out << "\n";
  }
  out << std::flush;
}

void print(std::ostream& out, const Verdict& verdict) {
  out << "\nat a confidence of " << std::defaultfloat << verdict.confidence
      << ", a count rejected where it is rarer than " << static_cast<double>(significance) << ":\n";
  print(out, "images", verdict.images, verdict.confidence);
  for (std::size_t s = 0; s < stratum_names.size(); ++s)
    print(out, stratum_names[s], verdict.strata[s], verdict.confidence, verdict.strata_ratio[s]);
  if (verdict.biased.trials > 0) {
    print(out, "seeded bias", verdict.biased, verdict.confidence);
    out << "  the seeded bias is caught in " << verdict.caught_scenes << " of " << verdict.biased_scenes
        << " scenes by themselves\n";
  }
  out << "  true/claimed in [0.4, 1.05]: " << verdict.close << " of " << verdict.trials
      << "; target met: " << verdict.met << "; judged by a coarse reference: " << verdict.coarse << "\n";
  for (const std::string& sentence : verdict.broken) out << "BROKEN  " << sentence << "\n";
  out << (verdict.broken.empty() ? "every promise is kept" : std::to_string(verdict.broken.size()) + " criteria broken")
      << std::endl;
}

void write_json(std::ostream& out, const std::vector<Outcome>& outcomes, const Verdict& verdict) {
  out << std::defaultfloat << std::setprecision(9) << "{\"confidence\": " << verdict.confidence
      << ", \"honest\": " << (verdict.broken.empty() ? "true" : "false") << ", \"trials\": [";
  const char* between = "\n";
  const auto write = [&](const std::string& scene, const Trial& trial, bool biased) {
    out << between << R"({"scene": ")" << scene << R"(", "biased": )" << (biased ? "true" : "false")
        << ", \"target\": " << trial.target << ", \"seed\": " << trial.seed << ", \"claimed\": " << trial.error.estimate
        << ", \"sampling\": " << trial.error.sampling << ", \"depth\": " << trial.error.depth
        << ", \"cutoff\": " << trial.error.cutoff << ", \"true\": " << trial.truth
        << ", \"reference_error\": " << trial.reference_error
        << ", \"met\": " << (trial.error.target_met ? "true" : "false")
        << ", \"samples_per_pixel\": " << trial.samples_per_pixel << ", \"strata\": {";
    for (std::size_t s = 0; s < stratum_names.size(); ++s)
      out << (s > 0 ? ", " : "") << '"' << stratum_names[s] << R"(": {"pixels": )" << trial.strata[s].pixels
          << ", \"true\": " << trial.strata[s].truth << ", \"claimed\": " << trial.strata[s].claimed << "}";
    out << "}}";
    between = ",\n";
  };
  for (const Outcome& outcome : outcomes) {
    for (const Trial& trial : outcome.trials) write(outcome.scene, trial, false);
    for (const Trial& trial : outcome.biased) write(outcome.scene, trial, true);
  }
  out << "\n]}\n";
}

}  // namespace honesty
