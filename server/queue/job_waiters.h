#pragma once
/// Callers that wait for the end of a job or for a preview of it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/queue/clock.h"
#include "server/queue/job_runner.h"
#include "server/queue/job_store.h"

namespace queue {

/// Pixels along the longer side. With alpha and all noise that is 4 MB.
inline constexpr std::uint32_t preview_side_max = 1024;

/// That of the last preview of a job that was cancelled.
inline constexpr std::uint32_t last_preview_side = 512;

/// Previews of running jobs, kept in memory while a client requests them. Jobs without requests cost nothing.
/// Thread-safe. A job has at most `sides_max` previews of different sizes; the oldest is dropped.
class Previews {
 public:
  using Png = std::shared_ptr<const std::string>;
  using Calls = std::vector<std::function<void()>>;
  static constexpr std::size_t sides_max = 4;
  static constexpr std::int64_t fresh_ms = 500;  ///< bounds how often a preview is made

  explicit Previews(Clock clock) : clock_(std::move(clock)) {}

  void begin(const std::string& id);                           ///< the job runs here: its previews are kept until `end`
  [[nodiscard]] bool is_running(const std::string& id) const;  ///< since `begin`
  [[nodiscard]] bool is_requested(const std::string& id, std::uint32_t side) const;

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

  /// Ignored where the job does not run here and the preview is not requested. The caller makes the returned calls,
  /// with no lock of its own held.
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

/// Thread-safe.
class JobWaiters {
 public:
  JobWaiters(JobStore& jobs, AttachedRunner& runner, Clock clock)
      : jobs_(jobs), runner_(runner), previews_(std::move(clock)) {}

  /// Calls `done` once, from any thread, when the job has ended (at once, from this thread, if it has or does not
  /// exist). `done` must be quick and must not throw. Returns a token for `cancel`.
  std::uint64_t when_ended(const std::string& id, std::function<void()> done);
  void cancel(std::uint64_t token);

  /// The latest preview of a running job, at most `side` (<= preview_side_max) pixels wide and high.
  Previews::Latest preview(const std::string& id, std::uint32_t side) { return previews_.latest(id, side); }
  /// Requests a newer one. Calls `done` once, from any thread, when it is there or the job no longer runs, and never
  /// where it did not run. Otherwise as when_ended. Returns a token for `cancel_preview`.
  std::uint64_t request_preview(const std::string& id, std::uint32_t side, std::function<void()> done);
  void cancel_preview(std::uint64_t token) { previews_.cancel(token); }
  /// Like request_preview, but only for a job that this node runs: returns false for others.
  bool request_own_preview(const std::string& id, std::uint32_t side, std::function<void()> done);
  [[nodiscard]] bool is_preview_requested(const std::string& id, std::uint32_t side) const {
    return previews_.is_requested(id, side);
  }

  // ---- for the runner and the life cycle of jobs
  void on_started(const std::string& id) { previews_.begin(id); }
  void add_preview(const std::string& id, std::uint32_t side, std::string png);  ///< see Previews::add
  void on_stopped(const std::string& id);                                        ///< ended or released
  void on_ended(const std::string& id);
  void wake_all();  ///< the ends of some jobs may have been missed

 private:
  struct Waiter {
    std::string id;
    std::function<void()> done;
  };

  JobStore& jobs_;
  AttachedRunner& runner_;
  Previews previews_;
  std::mutex mutex_;                                            ///< never held over a call of the store or of a waiter
  std::map<std::uint64_t, Waiter> waiters_;                     ///< by token
  std::unordered_multimap<std::string, std::uint64_t> tokens_;  ///< by job id
  std::uint64_t last_token_ = 0;
};

}  // namespace queue
