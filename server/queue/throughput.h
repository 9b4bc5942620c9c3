#pragma once
/// The recent speed of this machine, for estimates of time.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>

namespace queue {

/// Thread-safe.
class ThroughputEstimate {
 public:
  /// Adds a job that succeeded after `seconds` > 0; `work` > 0 is its Job::work. While it ran it shared the machine: at
  /// its end `at_once` jobs ran, itself included.
  void add(double seconds, double work, std::size_t at_once) {
    const std::lock_guard lock(mutex_);
    seconds_per_work_.push_back(seconds / static_cast<double>(at_once) / work);
    if (seconds_per_work_.size() > jobs_max) seconds_per_work_.pop_front();
  }
  /// Median over the latest jobs, for the whole machine; nothing before the first one.
  [[nodiscard]] std::optional<double> seconds_per_work() const {
    const std::lock_guard lock(mutex_);
    std::deque<double> sorted = seconds_per_work_;
    if (sorted.empty()) return std::nullopt;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }

  static constexpr std::size_t jobs_max = 63;  ///< recent enough to follow a change, enough for a stable median

 private:
  mutable std::mutex mutex_;
  std::deque<double> seconds_per_work_;  ///< oldest first
};

}  // namespace queue
