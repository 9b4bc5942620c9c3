#pragma once
/// The course of the service over the last hour, for GET /v1/status.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
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

  void count_end(bool failed);
  void add_wait(std::int64_t wait_ms);
  void add_rays(std::uint64_t rays);
  /// Ends the current step and begins the next one.
  void close_step(std::int64_t now, std::int64_t queued, std::int64_t running, std::int64_t rss_bytes);
  [[nodiscard]] Hour hour() const;

 private:
  mutable std::mutex mutex_;
  Step current_;
  std::vector<std::int64_t> waits_ms_;  ///< jobs of the current step
  std::deque<Step> closed_;
  std::int64_t until_ = 0;
};

}  // namespace telemetry
