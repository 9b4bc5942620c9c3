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
  ErrorGoal(const Adaptive& target, std::size_t pixels)
      : wanted_(target.target_error.value_or(target.tile_error.value_or(invisible_error))),
        channels_(3 * static_cast<double>(pixels)) {}

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
  /// True if looks should exclude an unseen error of this size before samples lower others: that costs less.
  [[nodiscard]] bool unseen_is_large(double error) const { return error > 0.05 * squared(); }

 private:
  double wanted_, channels_;
};

}  // namespace tracer
