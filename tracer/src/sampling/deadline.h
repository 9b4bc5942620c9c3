#pragma once
/// A time budget: how much of it is left, and what that is worth.

#include <algorithm>
#include <limits>

#include "tracer/render.h"

namespace tracer {

/// Any thread may ask whether there is time; the rest is the one thread's that plans, while no other asks.
class Deadline {
 public:
  /// `threads`: that trace at the same time.
  Deadline(const RenderSettings& settings, const Adaptive& wanted, std::uint32_t threads)
      : settings_(settings), threads_(threads) {
    if (!settings.elapsed_ms || !wanted.time_budget_ms) return;
    budget_ms_ = *wanted.time_budget_ms;
    start_ms_ = settings.elapsed_ms();
    reserve_ms_ = reserved_for_audit * budget_ms_;
  }

  [[nodiscard]] bool set() const { return budget_ms_ < never; }
  [[nodiscard]] bool over() const { return set() && settings_.elapsed_ms() >= end_ms(); }
  /// Whether a thread that begins so many samples now is likely to end them in time.
  [[nodiscard]] bool over_before(double samples) const {
    return set() && settings_.elapsed_ms() + samples * thread_ms_per_sample_ >= end_ms();
  }
  [[nodiscard]] bool leaves(double ms) const { return !set() || settings_.elapsed_ms() + ms < end_ms(); }
  [[nodiscard]] double part_gone() const { return set() ? std::min(1.0, settings_.elapsed_ms() / budget_ms_) : 0; }

  /// To be called once room for the image has been made: to write it in the end takes about as long.
  void keep_time_to_write() {
    if (!set()) return;
    write_ms_ = traced_ms();
    reserve_ms_ += write_ms_;
  }

  /// Learns how long samples take, all those so far being `samples`.
  void learn(std::uint64_t samples) {
    if (!set() || samples == 0) return;
    thread_ms_per_sample_ = traced_ms() * threads_ / static_cast<double>(samples);
  }

  /// Calls `work`, which every round does again after its samples and the end once more: as much time is kept for it.
  template <class Work>
  void keep_time_for(const Work& work) {
    const double before = set() ? settings_.elapsed_ms() : 0;
    work();
    if (set()) reserve_ms_ = 2 * (settings_.elapsed_ms() - before) + write_ms_ + reserved_for_audit * budget_ms_;
  }

  /// Samples that the closing audit may cost; infinite without a budget. Against a budget that is over before anything
  /// was learned, none.
  [[nodiscard]] double audit_samples() const {
    if (!set()) return never;
    if (!(thread_ms_per_sample_ > 0)) return 0;
    return audit_share * budget_ms_ * threads_ / thread_ms_per_sample_;
  }

  /// Rays that the next round may cost, `rays` having been traced so far: part of what is left, so that a later round
  /// can know better, and nearly all of it when little is.
  [[nodiscard]] double affordable(std::uint64_t rays) const {
    if (!set()) return never;
    const double left = end_ms() - settings_.elapsed_ms();
    const double rays_per_ms = static_cast<double>(rays) / traced_ms();
    const bool last = left < 0.3 * budget_ms_;
    return std::max(0.0, left * (last ? 0.9 : 0.5) * rays_per_ms);
  }

 private:
  static constexpr double never = std::numeric_limits<double>::infinity();
  /// Of the budget, for fresh samples that tell what the image is worth; and with room for their being dearer than
  /// others.
  static constexpr double audit_share = 0.04, reserved_for_audit = 0.08;

  [[nodiscard]] double end_ms() const { return budget_ms_ - reserve_ms_; }
  [[nodiscard]] double traced_ms() const { return std::max(settings_.elapsed_ms() - start_ms_, 1e-3); }

  const RenderSettings& settings_;
  double threads_ = 1, budget_ms_ = never, start_ms_ = 0, write_ms_ = 0, reserve_ms_ = 0, thread_ms_per_sample_ = 0;
};

}  // namespace tracer
