#pragma once
/// Previews of running jobs, kept in memory while a client asks for them. Jobs without requests cost nothing.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/clock.h"

namespace queue {

/// Pixels along the longer side. With alpha and all noise that is 4 MB.
inline constexpr std::uint32_t preview_side_max = 1024;

/// Thread-safe. A job has at most `sides_max` previews of different sizes; the oldest is dropped.
class Previews {
 public:
  using Png = std::shared_ptr<const std::string>;
  using Calls = std::vector<std::function<void()>>;
  static constexpr std::size_t sides_max = 4;
  static constexpr std::int64_t fresh_ms = 500;  ///< bounds how often a preview is made

  explicit Previews(Clock clock) : clock_(std::move(clock)) {}

  void begin(const std::string& id);  ///< the job runs: its previews are kept until `end`

  struct Latest {
    Png png;             ///< null: there is none
    bool fresh = false;  ///< not older than fresh_ms
  };
  [[nodiscard]] Latest latest(const std::string& id, std::uint32_t side) const;

  struct Request {
    std::uint64_t token = 0;  ///< for `cancel`
    bool is_new = false;      ///< no earlier request for the same preview is open
  };
  /// `done` is among the calls of the next `add` of that size, or of `end`.
  Request request(const std::string& id, std::uint32_t side, std::function<void()> done);
  void cancel(std::uint64_t token);

  /// The caller makes the returned calls, with no lock of its own held.
  [[nodiscard]] Calls add(const std::string& id, std::uint32_t side, std::string png);
  [[nodiscard]] Calls end(const std::string& id);  ///< drops all previews of the job

 private:
  using Key = std::pair<std::string, std::uint32_t>;
  struct Entry {
    Png png;
    std::int64_t at = 0;
  };
  struct Waiter {
    std::uint64_t token = 0;
    std::function<void()> done;
  };

  void evict_oldest(const std::string& id);

  const Clock clock_;
  mutable std::mutex mutex_;
  std::set<std::string> running_;
  std::map<Key, Entry> entries_;
  std::multimap<Key, Waiter> waiters_;
  std::uint64_t last_token_ = 0;
};

}  // namespace queue
