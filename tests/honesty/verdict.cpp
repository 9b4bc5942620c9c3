#include "tests/honesty/verdict.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace honesty {
namespace {

/// The standard deviation of a row's truth, relative to it, of which the mean square over rows is taken.
double relative_spread(const std::vector<Row>& rows) {
  double squares = 0, count = 0;
  for (const Row& row : rows) {
    if (row.truth == 0) continue;
    squares += row.spread * row.spread / (row.truth * row.truth);
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

struct GeometricMean {
  double logarithms = 0, count = 0;
  void add(double value) { logarithms += std::log(value), ++count; }
  [[nodiscard]] double value() const { return count > 0 ? std::exp(logarithms / count) : 0; }
};
using StratumRatios = std::array<GeometricMean, stratum_names.size()>;

void judge(const Outcome& outcome, Verdict& verdict, StratumRatios& ratios) {
  Coverage coverage, biased;
  for (const Trial& trial : outcome.trials) {
    verdict.confidence = std::min(verdict.confidence, trial.error.confidence);
    coverage.add(trial.covered());
    verdict.images.add(trial.covered());
    ++verdict.trials;
    verdict.close += trial.close() ? 1 : 0;
    verdict.met += trial.error.target_met ? 1 : 0;
    verdict.coarse += trial.coarse() ? 1 : 0;
    for (std::size_t s = 0; s < trial.strata.size(); ++s)
      if (const Share& share = trial.strata[s]; share.pixels >= stratum_pixels_min) {
        verdict.strata[s].add(share.truth <= share.claimed + (trial.coarse() ? trial.reference_error : 0));
        if (share.truth > 0 && share.claimed > 0) ratios[s].add(share.truth / share.claimed);
      }
    if (trial.error.target_met != (!trial.error.target || trial.error.estimate <= *trial.error.target))
      verdict.broken.push_back(outcome.scene + ": `met` is not what the estimate says");
  }
  if (coverage.rejected(verdict.confidence))
    verdict.broken.push_back(outcome.scene + ": " + std::to_string(coverage.misses) + " of " +
                             std::to_string(coverage.trials) + " claims do not hold");
  for (const std::string& growth : growths(rows_of(outcome))) verdict.broken.push_back(growth);
  for (const Trial& trial : outcome.biased) {
    biased.add(trial.covered());
    verdict.biased.add(trial.covered());
  }
  verdict.biased_scenes += outcome.biased.empty() ? 0 : 1;
  verdict.caught_scenes += biased.rejected(verdict.confidence) ? 1 : 0;
}

std::string percent(double part) {
  std::ostringstream text;
  text.precision(3);
  text << 100 * part << " %";
  return text.str();
}

}  // namespace

std::vector<Row> rows_of(const Outcome& outcome) {
  std::vector<Row> rows;
  for (const Trial& trial : outcome.trials) {
    if (rows.empty() || rows.back().target != trial.target) {
      rows.emplace_back();
      rows.back().scene = outcome.scene;
      rows.back().target = trial.target;
      rows.back().reference_error = trial.reference_error;
    }
    Row& row = rows.back();
    ++row.seeds;
    row.claimed += trial.error.estimate;
    row.truth += trial.truth * trial.truth;
    row.spread += trial.truth;  // the sum; the deviation once the mean is known
    row.samples_per_pixel += trial.samples_per_pixel;
    row.met += trial.error.target_met ? 1 : 0;
    row.coarse |= trial.coarse();
    row.coverage.add(trial.covered());
  }
  for (Row& row : rows) {
    const auto count = static_cast<double>(row.seeds);
    const double mean = row.spread / count;
    row.claimed /= count;
    row.samples_per_pixel /= count;
    row.spread = row.seeds < 2 ? 0 : std::sqrt(std::max(0.0, row.truth - count * mean * mean) / (count - 1));
    row.truth = std::sqrt(row.truth / count);
  }
  return rows;
}

std::vector<std::string> growths(const std::vector<Row>& rows) {
  std::vector<std::string> found;
  const double spread = relative_spread(rows);
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Row &coarser = rows[i - 1], &finer = rows[i];
    if (std::min(coarser.seeds, finer.seeds) < 3) continue;
    const double noise = spread * std::hypot(coarser.truth / std::sqrt(static_cast<double>(coarser.seeds)),
                                             finer.truth / std::sqrt(static_cast<double>(finer.seeds)));
    if (finer.truth <= coarser.truth + 4 * noise + finer.reference_error) continue;
    std::ostringstream text;
    text << finer.scene << ": the error grows from " << coarser.truth << " to " << finer.truth
         << " as the target falls from " << coarser.target << " to " << finer.target;
    found.push_back(text.str());
  }
  return found;
}

Verdict verdict_on(const std::vector<Outcome>& outcomes, double close_wanted) {
  Verdict verdict;
  StratumRatios ratios;
  for (const Outcome& outcome : outcomes) judge(outcome, verdict, ratios);
  for (std::size_t s = 0; s < ratios.size(); ++s) verdict.strata_ratio[s] = ratios[s].value();
  const auto part = [](std::uint64_t some, std::uint64_t all) {
    return all == 0 ? 0 : static_cast<double>(some) / static_cast<double>(all);
  };
  if (verdict.trials == 0) verdict.broken.emplace_back("nothing was tried");
  if (verdict.images.rejected(verdict.confidence))
    verdict.broken.push_back("images: " + percent(part(verdict.images.misses, verdict.images.trials)) +
                             " of the claims do not hold");
  for (std::size_t s = 0; s < stratum_names.size(); ++s)
    if (verdict.strata[s].rejected(verdict.confidence))
      verdict.broken.push_back("pixels of the stratum " + std::string(stratum_names[s]) + ": " +
                               percent(part(verdict.strata[s].misses, verdict.strata[s].trials)) +
                               " of the claims do not hold");
  if (part(verdict.close, verdict.trials) < close_wanted)
    verdict.broken.push_back("only " + percent(part(verdict.close, verdict.trials)) +
                             " of the claims are close to the truth, not " + percent(close_wanted));
  if (verdict.biased.trials > 0 && !verdict.biased.rejected(verdict.confidence))
    verdict.broken.emplace_back("the seeded bias is not caught");
  return verdict;
}

}  // namespace honesty
