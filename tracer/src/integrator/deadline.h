#pragma once
/// A time budget: how much of it is left, and how many rays that is worth.

#include <algorithm>
#include <limits>

#include "tracer/render.h"

namespace tracer {

/// Any thread may ask whether it is over; the rest is the one thread's that plans.
class Deadline {
 public:
  Deadline(const RenderSettings& settings, const Adaptive& wanted) : settings_(settings) {
    if (!settings.elapsed_ms || !wanted.time_budget_ms) return;
    budget_ms_ = *wanted.time_budget_ms;
    start_ms_ = settings.elapsed_ms();
  }

  [[nodiscard]] bool set() const { return budget_ms_ < never; }
  [[nodiscard]] bool over() const { return set() && settings_.elapsed_ms() >= budget_ms_ - reserve_ms_; }
  [[nodiscard]] double part_gone() const { return set() ? std::min(1.0, settings_.elapsed_ms() / budget_ms_) : 0; }

  /// Calls `work`, which every round does again after its samples and the end once more: as much time is kept for it.
  template <class Work>
  void keep_time_for(const Work& work) {
    const double before = set() ? settings_.elapsed_ms() : 0;
    work();
    if (set()) reserve_ms_ = 2 * (settings_.elapsed_ms() - before);
  }

  /// Rays that the next round may cost, `rays` having been traced so far: part of what is left, so that a later round
  /// can know better, and nearly all of it when little is.
  [[nodiscard]] double affordable(std::uint64_t rays) const {
    if (!set()) return never;
    const double now = settings_.elapsed_ms();
    const double left = budget_ms_ - reserve_ms_ - now;
    const double rays_per_ms = static_cast<double>(rays) / std::max(now - start_ms_, 1e-3);
    const bool last = left < 0.3 * budget_ms_;
    return std::max(0.0, left * (last ? 0.9 : 0.5) * rays_per_ms);
  }

 private:
  static constexpr double never = std::numeric_limits<double>::infinity();
  const RenderSettings& settings_;
  double budget_ms_ = never, start_ms_ = 0, reserve_ms_ = 0;
};

}  // namespace tracer
