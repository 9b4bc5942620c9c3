#pragma once
/// Recent render speed of this machine, for time estimates.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>

#include "api/report.h"

namespace telemetry {

/// Thread-safe.
class ThroughputEstimate {
 public:
  /// Adds a succeeded render. Ignored if the report has no estimated work.
  void add(const api::ReportFigures& figures) {
    if (!figures.seconds_per_work) return;
    const std::lock_guard lock(mutex_);
    seconds_per_work_.push_back(*figures.seconds_per_work);
    if (seconds_per_work_.size() > renders_max) seconds_per_work_.pop_front();
  }
  /// Median over the latest renders, per unit of api::estimated_work; nothing before the first one.
  [[nodiscard]] std::optional<double> seconds_per_work() const {
    std::unique_lock lock(mutex_);
    std::deque<double> sorted = seconds_per_work_;
    lock.unlock();
    if (sorted.empty()) return std::nullopt;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }

  static constexpr std::size_t renders_max = 63;  ///< recent enough to follow a change, enough for a stable median

 private:
  mutable std::mutex mutex_;
  std::deque<double> seconds_per_work_;  ///< oldest first
};

}  // namespace telemetry
