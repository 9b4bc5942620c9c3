#include "tracer/src/sampling/class_allocation.h"

#include <algorithm>
#include <numbers>

namespace tracer {
namespace {

constexpr double channel_count = 3;
/// The least variance that is expected of a mixed pixel: a pilot between two equal ones may be the exception.
constexpr double mixed_min = channel_count * 40;

/// Mean square of the distance of a sample from the pixel's mean, over the squared contrast: an edge at a random place
/// in the pixel has 1/6 - 1/12 of it, and is there in fewer of the pixels that differ from fewer neighbors.
double share_of_contrast(PixelKind kind) {
  constexpr std::array shares{0.03, 0.08, 0.12, 0.15};
  return shares[static_cast<std::size_t>(kind) % shares.size()];
}

}  // namespace

ClassAllocation::ClassAllocation(const ByClass<ClassCount>& counts, SampleDecay decay)
    : counts_(counts), decay_(decay) {
  // Two halves of n/2 strata vary 2^(p-1) times as much as n strata.
  const double halves = std::exp2(decay.power() - 1);
  for (std::size_t c = 0; c < class_count; ++c) {
    const PixelKind kind = pixel_kind(c);
    if (!is_mixed(c)) {
      const double slope = counts_[c].pixels > 0 ? counts_[c].slope / counts_[c].pixels : 0;
      prior_[c] = halves * std::max(4 * kept(c, {}), slope);
    } else if (kind == PixelKind::feature) {
      // A feature that covers a quarter of its pixel has four times the variance of the error without it.
      prior_[c] = halves * std::max(mixed_min, 4 * missed(c));
    } else if (kind == PixelKind::grown) {
      prior_[c] = halves * 2 * mixed_min;
    } else {
      const double middle = std::numbers::sqrt2 * std::exp2(static_cast<double>(c % contrast_bins));
      const double share = decay_.stratified ? share_of_contrast(kind) : 1;
      prior_[c] = halves * std::max(mixed_min, channel_count * share * middle);
    }
  }
}

void ClassAllocation::scale(double scale) {
  for (std::size_t c = 0; c < class_count; ++c) {
    prior_[c] *= scale;
    counts_[c].curvature *= scale;
    counts_[c].missed *= scale;
  }
}

void ClassAllocation::learn(const ByClass<ClassStatistics>& found) {
  // The contrast of noise includes that of the image, which may be much more.
  const double least = decay_.stratified ? 0.25 : 1.0 / 64;
  double pixels = prior_weight, ratios = prior_weight;
  for (std::size_t c = 0; c < class_count; ++c) {
    if (!follows_contrast(c) || !(found[c].own > 0 && prior_[c] > 0)) continue;
    pixels += found[c].pixels;
    ratios += found[c].pixels * found[c].error / (prior_[c] * found[c].own);
  }
  learned_ = std::clamp(ratios / pixels, least, 1.0);
}

/// A few halves may agree by chance: until there are many, the contrast counts as well.
ClassAllocation::Estimate ClassAllocation::estimate(std::size_t c, const ClassStatistics& found) const {
  const double unknown = prior_weight / (prior_weight + found.pixels), expected = unknown * by_contrast(c) * found.own,
               measured = (1 - unknown) * found.error + expected,
               of_others = decay_.joint() * found.others * variance(c, found), all = measured + of_others;
  if (!(found.error > 0)) return {all, all * all * unknown};
  const double scale = all / measured;  // the others have the uncertainty of those that were measured
  return {all, (found.squares + expected * expected) * scale * scale};
}

double ClassAllocation::kept(std::size_t c, const ClassStatistics& found) const {
  if (!is_mixed(c)) return counts_[c].pixels > 0 ? counts_[c].curvature / counts_[c].pixels : 0;
  // The center of a pixel is better than a sample by chance: 1/12 and 1/6 of the squared height of an edge.
  const double by_samples = variance(c, found) / (decay_.stratified ? 2 * std::exp2(decay_.power() - 1) : 1);
  if (pixel_kind(c) != PixelKind::feature) return by_samples;
  const double known = prior_weight / (prior_weight + found.pixels);
  return std::max(missed(c), (1 - known) * by_samples);
}

ClassAllocation::Samples ClassAllocation::solve(const Goal& goal, const ByClass<double>& left,
                                                const ByClass<ClassStatistics>& found) const {
  // Rays of pixels with edges diverge: each takes as much longer than rays of all pixels. Measured at 512 x 512: 1.05
  // where surfaces are rough, 1.3 in scenes of many mirrors.
  constexpr double incoherence = 1.25;
  ByClass<double> weight{}, error_of_one{}, cost{}, kept_below{};  // the last: samples
  double pixels = 0, rays = 0;
  for (std::size_t c = 0; c < class_count; ++c) {
    pixels += left[c];
    cost[c] = counts_[c].pixels > 0 ? counts_[c].rays / counts_[c].pixels : 1;
    rays += left[c] * cost[c];
  }
  const double mean_cost = pixels > 0 ? rays / pixels : 1;
  for (std::size_t c = 0; c < class_count; ++c) {
    // Looks may show more than the contrast of a class without samples.
    const double v = std::max(variance(c, found[c]), found[c].pixels > 0 ? 0 : 2 * goal.kept[c]);
    error_of_one[c] = v;
    weight[c] = std::pow(v * mean_cost / cost[c], 1 / (1 + decay_.power()));
    // The center of a smooth pixel is better than a few samples of it.
    const bool mixed = decay_.pilot_weight(pixel_kind(c)) > 0;
    kept_below[c] = mixed ? 1.6 : std::max(1.6, std::pow(v / std::max(goal.kept[c], 1e-9 * v), 1 / decay_.power()));
  }
  const auto samples_of = [&](std::size_t c, double density) {
    const double wanted = density * weight[c];
    if (wanted < kept_below[c]) return std::uint32_t{0};
    return 2 * std::max(1u, static_cast<std::uint32_t>(std::min(std::round(wanted / 2), samples_max / 2.0)));
  };
  // The error falls, and the cost rises, with the density: bisection of its logarithm, to a thousandth.
  double low = -20, high = 20;
  for (int step = 0; step < 16; ++step) {
    const double middle = (low + high) / 2, density = std::exp2(middle);
    double error = 0, spent = 0;
    for (std::size_t c = 0; c < class_count; ++c) {
      if (left[c] == 0) continue;
      const double wanted = std::min(density * weight[c], double{samples_max});
      const bool keeps = wanted < kept_below[c];
      error += left[c] * (keeps ? goal.kept[c] : error_of_one[c] * decay_.of(wanted));
      spent += keeps ? 0 : left[c] * cost[c] * wanted;
    }
    (error > goal.squared_error && spent <= goal.rays ? low : high) = middle;
  }
  Samples samples{};
  double spent = 0;
  for (std::size_t c = 0; c < class_count; ++c) {
    samples[c] = samples_of(c, std::exp2(high));
    spent += left[c] * cost[c] * samples[c];
  }
  if (!goal.may_be_uniform) return samples;
  double variance = 0;
  for (std::size_t c = 0; c < class_count; ++c) variance += left[c] * error_of_one[c];
  const double equal = std::ceil(std::pow(variance / goal.squared_error, 1 / decay_.power()) / 2) * 2;
  if (equal >= 2 && equal <= samples_max && equal * rays < std::min(spent * incoherence, goal.rays))
    samples.fill(static_cast<std::uint32_t>(equal));
  return samples;
}

}  // namespace tracer
