#pragma once
/// The course of the service over the last hour, for GET /v1/status.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace telemetry {

/// Steps of 5 s, the oldest first. Thread-safe.
class ServiceHistory {
 public:
  static constexpr std::int64_t step_ms = 5000;
  static constexpr std::size_t steps_max = 720;

  struct Step {
    std::int64_t queued = 0, running = 0;                  ///< jobs at its end
    std::int64_t ended = 0, failed = 0;                    ///< jobs that ended in it; failed ones are among them
    std::optional<std::int64_t> wait_p50_ms, wait_p95_ms;  ///< waiting time of those that ended; empty: none has run
    std::int64_t rays = 0;                                 ///< rays of jobs that succeeded
    std::int64_t rss_bytes = 0;                            ///< memory of daemon and worker at its end
  };
  struct Hour {
    std::vector<Step> steps;
    std::int64_t until = 0;  ///< end of the last step, ms since 1970 UTC; 0: there is none
  };

  /// Calls `change` with the current step and the waiting times of its jobs, in ms.
  template <class Change>
  void add(Change change) {
    const std::lock_guard lock(mutex_);
    change(current_, waits_ms_);
  }

  /// Ends the current step and begins the next one.
  void close_step(std::int64_t now, std::int64_t queued, std::int64_t running, std::int64_t rss_bytes) {
    const std::lock_guard lock(mutex_);
    std::sort(waits_ms_.begin(), waits_ms_.end());
    // The smallest value that at least `percent` % do not exceed (nearest rank).
    const auto percentile = [&](std::size_t percent) -> std::optional<std::int64_t> {
      if (waits_ms_.empty()) return std::nullopt;
      return waits_ms_[(waits_ms_.size() * percent + 99) / 100 - 1];
    };
    Step step = std::exchange(current_, {});
    step.queued = queued, step.running = running, step.rss_bytes = rss_bytes;
    step.wait_p50_ms = percentile(50), step.wait_p95_ms = percentile(95);
    waits_ms_.clear();
    closed_.push_back(step);
    if (closed_.size() > steps_max) closed_.pop_front();
    until_ = now;
  }

  [[nodiscard]] Hour hour() const {
    const std::lock_guard lock(mutex_);
    return {{closed_.begin(), closed_.end()}, until_};
  }

 private:
  mutable std::mutex mutex_;
  Step current_;
  std::vector<std::int64_t> waits_ms_;
  std::deque<Step> closed_;
  std::int64_t until_ = 0;
};

}  // namespace telemetry
