#pragma once
/// Allocates samples to the classes of pixels (pixel_classes.h), and estimates the error of their pixels.

#include <cmath>
#include <cstdint>

#include "tracer/src/sampling/pixel_classes.h"

namespace tracer {

/// Squared errors are in squared code values, summed over the channels.

/// Statistics of the samples of a class. Some of its pixels are measured: they have two independent halves.
struct ClassStatistics {
  double pixels = 0;   ///< that are measured
  double error = 0;    ///< sum of their squared errors: (F1 - F2)^2 / 4 of the halves
  double squares = 0;  ///< sum of the squares of these
  double own = 0;      ///< sum of n^-power over these pixels
  double others = 0;   ///< the same over the pixels that are not measured
  void add(const ClassStatistics& other) {
    pixels += other.pixels;
    error += other.error;
    squares += other.squares;
    own += other.own;
    others += other.others;
  }
  /// Multiplies the squared errors.
  void scale(double scale) {
    error *= scale;
    squares *= scale * scale;
  }
};

/// The error of a pixel falls like n^-power: 3/2 for stratified samples at an edge (Mitchell 1996, "Consequences of
/// Stratified Sampling in Graphics"), 1 for independent choices.
struct SampleDecay {
  bool stratified = true;
  [[nodiscard]] double power() const { return stratified ? 1.5 : 1; }
  [[nodiscard]] double of(double samples) const {
    return stratified ? 1 / (samples * std::sqrt(samples)) : 1 / samples;
  }
  /// The fewest further samples, an even number, with which a pixel's mean is as good as with one set of `wanted`
  /// samples, if it is as good as with one of `before`: 0 if it is good enough.
  [[nodiscard]] std::uint32_t further(double wanted, double before) const {
    if (wanted <= before) return 0;
    const double worth = 1 / of(wanted) - (before > 0 ? 1 / of(before) : 0);
    return 2 * static_cast<std::uint32_t>(std::ceil(std::pow(worth, 1 / power()) / 2));
  }
  /// Weight of a pilot beside samples, relative to one of these: the center of a pixel at an edge has half the squared
  /// error of a sample at a random place, 1/12 and 1/6 of the squared height. Elsewhere samples replace the pilot,
  /// which may have missed what they show: features, and small bright things in mirrors.
  [[nodiscard]] double pilot_weight(PixelKind kind) const { return stratified && kind < PixelKind::mirrored ? 2 : 0; }
  /// Error of a pixel with one set of strata, in parts of that of two independent halves of it: 2^(1 - power) and a
  /// margin, since many pixels are no edges.
  [[nodiscard]] double joint() const { return stratified ? 0.85 : 1; }
};

class ClassAllocation {
 public:
  ClassAllocation(const ByClass<ClassCount>& counts, SampleDecay decay);
  /// Multiplies all squared errors.
  void scale(double scale);
  /// Lowers what is expected by the contrast, in all classes alike, to what samples have shown.
  void learn(const ByClass<ClassStatistics>& found);

  /// Expected squared error of two halves of one sample together, for n samples times n^-power: from the contrast, and
  /// from what was measured.
  [[nodiscard]] double variance(std::size_t c, const ClassStatistics& found) const {
    const double measured = found.own > 0 ? found.pixels * found.error / found.own : 0;
    return (prior_weight * by_contrast(c) + measured) / (prior_weight + found.pixels);
  }
  /// Estimated error of the sampled pixels of a class, and its variance.
  struct Estimate {
    double squared = 0, variance = 0;
  };
  [[nodiscard]] Estimate estimate(std::size_t c, const ClassStatistics& found) const;
  /// Expected squared error of a pixel that keeps its pilot, from its contrast and the samples of the class.
  [[nodiscard]] double kept(std::size_t c, const ClassStatistics& found) const;

  struct Goal {
    double squared_error = 0;     ///< in the pixels `left`
    double rays = 0;              ///< most that they may cost
    ByClass<double> kept{};       ///< squared error of a pixel without further samples
    bool may_be_uniform = false;  ///< equally many samples for all classes, if that is expected to take less time
  };
  /// Samples for each pixel of a class; 0: it gets none. With a variance of one sample v, its cost c and errors
  /// falling like n^-p, n is proportional to (v / c)^(1 / (1 + p)) (for p = 1 Neyman 1934; Cochran 1977, "Sampling
  /// Techniques", sec. 5.5). At least 2.
  using Samples = ByClass<std::uint32_t>;
  [[nodiscard]] Samples solve(const Goal& goal, const ByClass<double>& left,
                              const ByClass<ClassStatistics>& found) const;

 private:
  /// Features have their own expectation.
  [[nodiscard]] static bool follows_contrast(std::size_t c) {
    return pixel_kind(c) != PixelKind::feature && !is_grown(c);
  }
  [[nodiscard]] double by_contrast(std::size_t c) const { return prior_[c] * (follows_contrast(c) ? learned_ : 1); }
  [[nodiscard]] double missed(std::size_t c) const {
    return counts_[c].pixels > 0 ? counts_[c].missed / counts_[c].pixels : 0;
  }

  static constexpr double prior_weight = 8;
  static constexpr std::uint32_t samples_max = 4096;
  ByClass<ClassCount> counts_;
  SampleDecay decay_;
  ByClass<double> prior_{};
  double learned_ = 1;  ///< measured variance over that by the contrast
};

}  // namespace tracer
