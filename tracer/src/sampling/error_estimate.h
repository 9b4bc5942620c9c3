#pragma once
/// The error of a whole image, from what each round of samples tells of its pixels.

#include <span>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/blocks.h"
#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

/// Sum of the pixels' squared errors, and how well it is known.
struct SampledError {
  double squared = 0;        ///< in squared levels, over pixels and channels; may be negative by chance
  double squared_upper = 0;  ///< what it is at most, at the stated confidence
};

/// Sums of squared errors, and of their squares, which tell how well the sum is known.
struct SummedErrors {
  double squared = 0, spread = 0;
  void add(double squared_error) { add(SummedErrors{squared_error, squared_error * squared_error}); }
  void add(const SummedErrors& part) {
    squared += part.squared;
    spread += part.spread;
  }
  /// Where the sum had a part in deciding when to stop.
  [[nodiscard]] SampledError known() const;
  /// Where it had none.
  [[nodiscard]] SampledError known_by_audit() const;
};

/// Of many.
SummedErrors summed(std::span<const float> squared_errors);

/// Squared errors of pixels chosen at random, which stand for more.
class AuditedError {
 public:
  void add(double squared_error) {
    sum_.add(squared_error);
    ++count_;
  }
  void add(const AuditedError& other) {
    sum_.add(other.sum_);
    count_ += other.count_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Of `pixels` of which these were chosen; nothing where none was.
  [[nodiscard]] SummedErrors of(std::size_t pixels) const;

 private:
  SummedErrors sum_;
  std::size_t count_ = 0;
};

/// The pixels that have only their pilot count as those of them that were audited; where none was, what was predicted
/// for them counts. Also learns: sets `variance` of every pixel to what is now to be expected of it.
SampledError update_variances(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& levels,
                              const InParallel& in_parallel);

/// What is known of an image from its own samples and from an audit of it: the greater.
SampledError joined(const SampledError& own, const SampledError& audit);

/// Sums over the image, in squared levels, of the light that is missing at most.
struct MissingError {
  double depth = 0, cutoff = 0, both = 0;
  /// `mean` of one channel of a pixel, and what it lacks.
  void add(double mean, double missing_depth, double missing_cutoff, const DisplayTransform& levels);
  void add(const MissingError& part);
};

/// sampling^2 + missing^2, over `pixels`, as an estimate that holds at its stated confidence.
ErrorEstimate error_estimate(const SampledError& sampled, const MissingError& omitted, std::size_t pixels);

/// Adds what an image's approximations cost, `exact` being the whole of its error as exact samples tell it.
void add_approximation(ErrorEstimate& error, const SampledError& exact, std::size_t pixels);

}  // namespace tracer
