#pragma once
/// The requested error, divided among the parts of an image's error.

#include <algorithm>
#include <cmath>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/sample_allocation.h"

namespace tracer {

/// Errors below this are invisible: levels.
inline constexpr double invisible_error = 0.1;

/// Squared errors are in code values, summed over channels and pixels.
class ErrorGoal {
 public:
  /// `rounds`: expected to be enough for the target, see of_round().
  ErrorGoal(const Adaptive& target, std::size_t pixels, std::uint32_t rounds = few_rounds)
      : wanted_(target.target_error.value_or(target.tile_error.value_or(invisible_error))),
        channels_(3 * static_cast<double>(pixels)),
        rounds_(rounds) {}

  /// Growth by eight in each round brings a pixel to 512 samples in three. The noise of paths needs more.
  static constexpr std::uint32_t few_rounds = 3, rounds_of_paths = 5;

  [[nodiscard]] double channels() const { return channels_; }
  /// Square of the target error; without one, of an error that is invisible.
  [[nodiscard]] double squared() const { return channels_ * wanted_ * wanted_; }
  /// Bound of the squared error of a pixel that needs no further samples: a level in each channel, or the target.
  [[nodiscard]] double certified() const { return 3 * std::pow(std::min(1.0, wanted_), 2); }
  /// Error of the pilots that leaves the refined pixels half of the target.
  [[nodiscard]] double proven() const { return squared() / 2; }
  /// Bound of open pixels that are cheaper to refine than to validate: to prove that pixels with a sum of bounds B have
  /// errors of at most E takes 3 B / E looks.
  [[nodiscard]] double bound_max() const { return proven() * refined_half / (3.0 * look_half); }
  /// True if samples may reach the target beside what they cannot lower.
  [[nodiscard]] bool leaves_room(const KnownErrors& known) const { return known.fixed < 0.9 * squared(); }
  /// Error by the brightest channel that is small beside the target, or beside what samples have left.
  [[nodiscard]] double tone_max(const KnownErrors& known) const {
    return std::max(squared(), known.sampled.squared_upper) / 8;
  }
  /// True if looks should lower a part of this size before samples lower others: that costs less.
  [[nodiscard]] bool is_large(double error) const { return error > 0.05 * squared(); }
  /// Error that the next round shall leave to samples, in the sum of the predicted errors of the pixels, which is now
  /// `predicted`. Predictions of far smaller errors are too high: the first step towards them goes only near the
  /// target. Rounds beyond those that were expected have lower and lower goals.
  [[nodiscard]] double of_round(const KnownErrors& known, double predicted, std::uint32_t round) const {
    constexpr double step = 2, step_max = 4;
    // Samples cannot lower what is fixed: if that prevents the target, the rest need not be smaller.
    double left = squared() - known.fixed;
    if (!leaves_room(known)) left = known.fixed;
    left -= std::min(known.tone, left / 2);  // samples of other pixels lower that
    const auto& [mean, upper] = known.sampled;
    if (upper > step_max * left) left *= step;
    // Margins for the uncertainty of the estimate and for predictions that were too low.
    const double margin = std::clamp(mean / std::max(upper, 1e-300), 0.5, 0.95);
    constexpr double lower = 0.8;
    const double late = std::pow(lower, round > rounds_ ? round - rounds_ : 0);
    return left * margin * late * (mean > predicted ? predicted / mean : 1);
  }

 private:
  double wanted_, channels_;
  std::uint32_t rounds_;
};

}  // namespace tracer
