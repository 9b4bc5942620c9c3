#pragma once
/// The recent speed of this machine, for estimates of time.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace queue {

/// Thread-safe.
class ThroughputEstimate {
 public:
  /// Adds a job that succeeded after `seconds` > 0; `work` > 0 is its Job::work. While it ran it shared the machine: at
  /// its end `at_once` jobs ran, itself included.
  void add(double seconds, double work, std::size_t at_once) {
    const std::lock_guard lock(mutex_);
    jobs_.emplace_back(seconds / static_cast<double>(at_once) / work, work);
    if (jobs_.size() > jobs_max) jobs_.pop_front();
  }
  /// Median over the latest jobs, weighted by their work, for the whole machine; nothing before the first one. Small
  /// jobs are slow for their work, and a job whose work was estimated much too low has little weight.
  [[nodiscard]] std::optional<double> seconds_per_work() const {
    const std::lock_guard lock(mutex_);
    std::deque<std::pair<double, double>> sorted = jobs_;
    std::sort(sorted.begin(), sorted.end());
    double all = 0, below = 0;
    for (const auto& [seconds, work] : sorted) all += work;
    for (const auto& [seconds, work] : sorted)
      if ((below += work) >= all / 2) return seconds;
    return std::nullopt;
  }

  static constexpr std::size_t jobs_max = 63;  ///< recent enough to follow a change, enough for a stable median

 private:
  mutable std::mutex mutex_;
  std::deque<std::pair<double, double>> jobs_;  ///< seconds per work, work; oldest first
};

}  // namespace queue
