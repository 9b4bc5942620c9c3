#pragma once
/// The times at which running jobs are stopped, reported as ended or cost the worker its process, and the end of a
/// drain.

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

/// Used by one thread.
class Deadlines {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit Deadlines(const SupervisorSettings& settings) : settings_(settings) {}

  /// `job` starts to run; it is due to stop at its deadline or after the wall time, whichever is earlier.
  void add(const queue::Job& job, Time now);
  void remove(const std::string& id) { jobs_.erase(id); }
  void clear() { jobs_.clear(); }

  struct Overdue {
    std::string job_id;
    queue::Problem problem;
  };
  /// Jobs whose time is over, each once.
  std::vector<Overdue> take_overdue(Time now);

  /// Small jobs that have taken longer than small_job_time, each once. None if there is a single slot.
  std::vector<std::string> take_slow(Time now);

  /// The job is to stop. True for its first call: the worker has to be informed.
  bool stop(const std::string& id, Time now);
  /// Stopped jobs whose end is to be reported although the worker still runs them.
  std::vector<std::string> take_reportable(Time now);
  [[nodiscard]] bool is_reported(const std::string& id) const;

  /// True if a job has not been stopped within cancel_grace.
  [[nodiscard]] bool worker_must_end(Time now) const;

  void start_drain(Time end);
  [[nodiscard]] bool draining() const { return drain_end_.has_value(); }
  [[nodiscard]] bool drain_ended() const { return drain_ended_; }
  bool take_drain_end(Time now);  ///< true once, at the end of the drain

  /// The earliest of all these times.
  [[nodiscard]] Time next(bool worker_ready) const;

 private:
  struct JobTimes {
    std::optional<Time> stop_at, slow_at;
    queue::Problem overdue;  ///< the reason if stop_at is reached
    std::optional<Time> report_at, kill_at;
    bool reported = false;
  };

  const SupervisorSettings& settings_;
  std::map<std::string, JobTimes> jobs_;
  std::optional<Time> drain_end_;
  bool drain_ended_ = false;
};

}  // namespace worker
