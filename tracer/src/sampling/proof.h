#pragma once
/// Proof of the error of a finished image (`Accuracy::proof`): an upper bound that holds for any scene, whatever the
/// samples of the image have missed.
///
/// 1. The radiance of each pixel lies in an interval (certify), which bounds its squared error by some u.
/// 2. Looks at pixels, drawn in proportion to u: a look estimates the squared error of a pixel by two fresh halves of
///    samples, without approximations and limits of rays. Divided by u the estimate is at most 1, and its mean over all
///    draws is the squared error of the image divided by the sum of u.
/// 3. A confidence sequence bounds that mean (confidence_sequence.h): n looks without a find prove about 3.2 / n of the
///    sum of u, for images of any size. Looks go on until the target is proven or they have cost as much as the image.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tracer/src/certify/pixel_bounds.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/confidence_sequence.h"
#include "tracer/src/sampling/look_tracer.h"
#include "tracer/src/sampling/looks.h"

namespace tracer {

/// Estimate of the squared error of the pixel `value` by two independent halves, in squared code values, summed over
/// the channels. With a linear curve the product of both differences is unbiased. With that of the display it is too
/// small for a dark pixel with bright specks, which one half alone hits; twice the square for the mean of the halves
/// less the mean of their squares is unbiased to the second order of the noise (jackknife: Quenouille 1956, "Notes on
/// Bias in Estimation") and too small for a pixel that is right but noisy. The larger one counts.
double squared_error(const Color& value, const Halves& fresh, const DisplayTransform& display);

/// The largest estimate whose halves lie in the interval, and so the largest squared error. Below white it is the
/// largest squared distance from `value`; where halves may be so bright that their mean is clipped, 3/2 of it.
double squared_error_bound(const RadianceInterval& interval, const Color& value, const DisplayTransform& display);

/// Bound of the error of an image by looks at its pixels. The scene and the image must outlive it.
class ErrorProof {
 public:
  /// Bounds the errors of all pixels; when `hurry` returns true, the rest by the radiance of the whole scene. Not to be
  /// used if cancelled. Throws std::bad_alloc.
  ErrorProof(const CompiledScene& scene, const Image& image, const InParallel& in_parallel,
             const RenderControl& control, const std::function<bool()>& hurry);

  /// Independent draws, each with samples of its own.
  [[nodiscard]] std::vector<Look> draw(std::size_t count) const;
  /// Adds these looks; one without finite samples counts with its whole bound.
  void add(std::span<const Look> looks, std::span<const std::optional<Halves>> halves);

  [[nodiscard]] std::uint64_t count() const { return sequence_.count(); }
  /// Upper bound of the root mean square error, in levels; infinity if Russian roulette exceeded the bound of a look.
  [[nodiscard]] double bound() const;

 private:
  [[nodiscard]] Color value(std::size_t place) const;

  static constexpr double alpha = 0.05;  ///< 1 - ErrorEstimate::confidence
  const CompiledScene& scene_;
  const Image& image_;
  const DisplayTransform display_;
  std::vector<double> sums_;  ///< bounds of the squared errors, summed up to and including each pixel
  ConfidenceSequence sequence_{alpha};
  bool exceeded_ = false;  ///< a look had more than its bound
};

/// Sets `proven` of the image, unless cancelled, and adds the counts of the looks. Nothing is proven if the brightest
/// pixel divides the image. Throws std::bad_alloc.
inline void prove_error(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                        Rendered& rendered) {
  constexpr std::size_t first_looks = 256, timed_looks = 64;
  ErrorEstimate& error = rendered.error;
  if (scene.output.overflow == Output::Overflow::scale) return;
  const bool timed = settings.elapsed_ms && scene.accuracy.adaptive && scene.accuracy.adaptive->time_budget_ms;
  const double budget_ms = timed ? *scene.accuracy.adaptive->time_budget_ms : std::numeric_limits<double>::infinity();
  const auto elapsed_ms = [&] { return timed ? settings.elapsed_ms() : 0.0; };
  const double start_ms = elapsed_ms(), end_ms = std::min(budget_ms, start_ms + proof_share * budget_ms),
               hurry_ms = start_ms + (end_ms - start_ms) / 2;
  const auto in_parallel = [&](auto count, const auto& work) { for_each_tile(count, settings.threads, work); };
  ErrorProof proof(scene, rendered.image, in_parallel, control, [&] { return timed && elapsed_ms() > hurry_ms; });
  TracerPool<> pool(make_wavefront, scene, control, {});
  LookTracer tracer({scene, settings, control, pool}, PartKind::whole_looks);
  const std::uint64_t most = std::max<std::uint64_t>(looks_min, rendered.statistics.samples / (2 * look_half));
  const double target = scene.accuracy.target().value_or(0);
  for (double before = elapsed_ms(); !control.cancelled() && (timed || proof.count() < most);) {
    const std::uint64_t doubled = std::max<std::uint64_t>(proof.count(), first_looks);
    const std::vector<Look> looks = proof.draw(timed ? timed_looks : std::min(doubled, most - proof.count()));
    const std::vector<std::optional<Halves>> halves = tracer.halves(looks, look_half);
    if (looks.empty() || control.cancelled()) break;
    proof.add(looks, halves);
    error.proven = proof.bound();
    const double now = elapsed_ms();
    if (error.proven <= target || 2 * now - before >= end_ms) break;
    before = now;
  }
  if (proof.bound() == 0) error.proven = 0;  // no pixel is in doubt
  error.looks += proof.count();
  add(rendered.statistics, pool.statistics());
  rendered.statistics.holdout_samples += tracer.samples();
}

}  // namespace tracer
