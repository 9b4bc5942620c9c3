#pragma once
/// Callers that wait for the end of a job or for a preview of it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <tuple>
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

/// Previews of running jobs, kept in memory while a client requests them, and the calls that wait for them or for the
/// end of a job. Jobs without requests cost nothing. Thread-safe. A job has at most `sides_max` previews of different
/// sizes; the oldest is dropped.
class Previews {
 public:
  using Png = std::shared_ptr<const std::string>;
  using Calls = std::vector<std::function<void()>>;
  static constexpr std::size_t sides_max = 4;
  static constexpr std::int64_t fresh_ms = 500;                         ///< bounds how often a preview is made
  static constexpr std::uint32_t at_end = 0;                            ///< in place of a side: the end of the job
  using Token = std::tuple<std::string, std::uint32_t, std::uint64_t>;  ///< job, side, number of the call

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
    Token token;          ///< for `cancel`
    bool is_new = false;  ///< no earlier request for the same preview is open
  };
  /// `done` is among the calls of the next `add` of that size, or of `end`; with `at_end` among those of `ended`.
  Request request(const std::string& id, std::uint32_t side, std::function<void()> done);
  void cancel(const Token& token);

  /// Ignored where the job does not run here and the preview is not requested. The caller makes the returned calls,
  /// with no lock of its own held.
  [[nodiscard]] Calls add(const std::string& id, std::uint32_t side, std::string png);
  [[nodiscard]] Calls end(const std::string& id);    ///< drops all previews of the job
  [[nodiscard]] Calls ended(const std::string& id);  ///< the job has ended
  [[nodiscard]] Calls all_at_end();                  ///< those that wait for the end of any job

 private:
  using Key = std::pair<std::string, std::uint32_t>;
  struct Entry {
    Png png;
    std::int64_t at = 0;
  };

  [[nodiscard]] bool waits(const Key& key) const;
  Calls take(const std::string& id, std::uint32_t first_side, std::uint32_t last_side);
  void evict_oldest(const std::string& id);

  const Clock clock_;
  mutable std::mutex mutex_;
  std::set<std::string> running_;
  std::map<Key, Entry> entries_;
  std::map<Token, std::function<void()>> waiters_;
  std::uint64_t last_number_ = 0;
};

/// Thread-safe.
class JobWaiters {
 public:
  JobWaiters(JobStore& jobs, AttachedRunner& runner, Clock clock)
      : jobs_(jobs), runner_(runner), previews_(std::move(clock)) {}

  /// Calls `done` once, from any thread, when the job has ended (at once, from this thread, if it has or does not
  /// exist). `done` must be quick and must not throw. Returns a token for `cancel`.
  Previews::Token when_ended(const std::string& id, std::function<void()> done);
  void cancel(const Previews::Token& token) { previews_.cancel(token); }

  /// The latest preview of a running job, at most `side` (<= preview_side_max) pixels wide and high.
  Previews::Latest preview(const std::string& id, std::uint32_t side) { return previews_.latest(id, side); }
  /// Requests a newer one. Calls `done` once, from any thread, when it is there or the job no longer runs, and never
  /// where it did not run. Otherwise as when_ended.
  Previews::Token request_preview(const std::string& id, std::uint32_t side, std::function<void()> done);
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
  JobStore& jobs_;
  AttachedRunner& runner_;
  Previews previews_;
};

}  // namespace queue
