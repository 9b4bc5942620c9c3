#pragma once
/// Deadlines of clients, ordered by time.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

namespace http {

using Time = std::chrono::steady_clock::time_point;

/// A client whose deadline moves has several timers; their receiver ignores those that it replaced.
class TimerQueue {
 public:
  using Timer = std::pair<Time, std::uint64_t>;  ///< deadline and number of the client

  void add(Time deadline, std::uint64_t client) { timers_.emplace(deadline, client); }

  /// Removes and returns a timer whose deadline has passed.
  std::optional<Timer> take_due(Time now) {
    if (timers_.empty() || timers_.top().first > now) return std::nullopt;
    const Timer timer = timers_.top();
    timers_.pop();
    return timer;
  }

  /// Timeout for epoll_wait until the next deadline, at most a minute; -1 without timers.
  [[nodiscard]] int timeout_ms() const {
    if (timers_.empty()) return -1;
    const auto left = timers_.top().first - std::chrono::steady_clock::now();
    const auto left_ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    return static_cast<int>(std::clamp<std::int64_t>(left_ms, 0, 60'000));
  }

 private:
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
};

}  // namespace http
