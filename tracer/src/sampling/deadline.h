#pragma once
/// Deadline of a render with a time budget, and the work that fits before it.

#include <algorithm>
#include <limits>

#include "tracer/render.h"

namespace tracer {

/// Share of a time budget that is left to the proof of the image's error. Half of it at most is for bounds of pixels.
inline constexpr double proof_share = 0.25;

/// Any thread may call set(), over(), over_before(), spent() and fraction_elapsed() while no thread calls the
/// rest.
class Deadline {
 public:
  /// `threads`: number of threads that trace concurrently.
  /// `last_share`: fraction of the budget that is kept for work after the samples of the image.
  /// `budget_share`: fraction of the time budget that counts as the budget.
  Deadline(const RenderSettings& settings, const Adaptive& target, std::uint32_t threads, double last_share = 0,
           double budget_share = 1)
      : settings_(settings), threads_(threads), reserve_share_(holdout_reserve + last_share) {
    if (!settings.elapsed_ms || !target.time_budget_ms) return;
    budget_ms_ = budget_share * *target.time_budget_ms;
    start_ms_ = settings.elapsed_ms();
    reserve_ms_ = reserve_share_ * budget_ms_;
  }

  [[nodiscard]] bool set() const { return budget_ms_ < never; }
  [[nodiscard]] bool over() const { return set() && settings_.elapsed_ms() >= end_ms(); }
  /// True when what is kept for the last work is used up too.
  [[nodiscard]] bool spent() const { return set() && settings_.elapsed_ms() >= budget_ms_ - write_ms_; }
  /// True if a thread that starts so many samples now is unlikely to finish them in time.
  [[nodiscard]] bool over_before(double samples) const {
    return set() && settings_.elapsed_ms() + samples * thread_ms_per_sample_ >= end_ms();
  }
  [[nodiscard]] double fraction_elapsed() const {
    return set() ? std::min(1.0, settings_.elapsed_ms() / budget_ms_) : 0;
  }

  /// Called once the image is allocated: writing it at the end takes about as long.
  void reserve_time_to_write() {
    if (!set()) return;
    write_ms_ = traced_ms();
    reserve_ms_ += write_ms_;
  }

  /// Measures the time per sample; `samples`: number of all samples so far.
  void measure_rate(std::uint64_t samples) {
    if (!set() || samples == 0) return;
    thread_ms_per_sample_ = traced_ms() * threads_ / static_cast<double>(samples);
  }

  /// Number of holdout samples that validation may take; infinite without a budget, 0 before any rate was measured.
  [[nodiscard]] double holdout_samples() const {
    if (!set()) return never;
    if (!(thread_ms_per_sample_ > 0)) return 0;
    return holdout_share * budget_ms_ * threads_ / thread_ms_per_sample_;
  }

  /// Number of rays that the next round may take; `rays`: number of all rays so far. Most of the remaining
  /// time, so that a later round can use better estimates, or nearly all of it when little is left.
  [[nodiscard]] double affordable(std::uint64_t rays) const {
    if (!set()) return never;
    const double left = end_ms() - settings_.elapsed_ms();
    const double rays_per_ms = static_cast<double>(rays) / traced_ms();
    const bool last = left < 0.3 * budget_ms_;
    return std::max(0.0, left * (last ? 0.9 : 0.65) * rays_per_ms);
  }

 private:
  static constexpr double never = std::numeric_limits<double>::infinity();
  /// Fraction of the budget for holdout samples, and the reserve for them: they may take longer than others.
  static constexpr double holdout_share = 0.04, holdout_reserve = 0.08;

  [[nodiscard]] double end_ms() const { return budget_ms_ - reserve_ms_; }
  [[nodiscard]] double traced_ms() const { return std::max(settings_.elapsed_ms() - start_ms_, 1e-3); }

  const RenderSettings& settings_;
  double threads_ = 1, reserve_share_ = 0, budget_ms_ = never, start_ms_ = 0, write_ms_ = 0, reserve_ms_ = 0,
         thread_ms_per_sample_ = 0;
};

}  // namespace tracer
