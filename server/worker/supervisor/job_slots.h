#pragma once
/// The jobs in the worker process, their division among owners and among large and small jobs, and the times at which
/// they are stopped, reported as ended or cost the worker its process.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

using Time = std::chrono::steady_clock::time_point;

struct RunningJob {
  queue::Job job;  ///< as it was claimed; `large` and `cancel_requested` are those of now
  std::int64_t fence = 0;
  std::optional<Time> stop_at;                ///< at its deadline or after the wall time, whichever is earlier
  queue::Problem overdue;                     ///< the reason if stop_at is reached
  std::optional<Time> slow_at;                ///< after small_job_time; none if there is a single slot
  std::optional<Time> large_since;            ///< it was small before
  std::optional<Time> report_at, kill_at;     ///< since it is to stop
  bool reported = false;                      ///< its end was, although the worker still runs it
  bool yields_slot = false;                   ///< it is stopped to be queued again as a large job
  bool lease_lost = false;                    ///< the queue ignores its outcome
  std::optional<queue::Problem> stopped_for;  ///< by the supervisor
  std::optional<std::string> last_preview;    ///< to be kept with its end

  [[nodiscard]] bool is_stopping() const { return yields_slot || job.cancel_requested || stopped_for || lease_lost; }
  [[nodiscard]] bool keeps_preview() const { return job.keep && !lease_lost && (job.cancel_requested || stopped_for); }
};

/// Used by one thread.
class JobSlots {
 public:
  explicit JobSlots(const SupervisorSettings& settings) : settings_(settings) {}

  std::map<std::string, RunningJob> running;  ///< by job id

  void add(const queue::Job& job, std::int64_t fence, Time now);  ///< it starts to run
  /// The earliest of all times that have not passed; without a worker that is ready those of reports only.
  [[nodiscard]] Time next_deadline(bool worker_ready) const;

  /// One slot is never given to a large job, so that small images need not wait for the end of large ones. `claims` may
  /// return large jobs.
  [[nodiscard]] bool has_slot_for_large(std::size_t claims) const;
  /// True if owner_slots jobs of the owner run.
  [[nodiscard]] bool is_busy(const std::string& owner) const;
  [[nodiscard]] std::vector<std::string> busy_owners() const;
  /// The job to queue again because large jobs occupy all slots: the last one that became large. Null if there is none,
  /// or if a job is being stopped already.
  RunningJob* surplus_large_job();

 private:
  [[nodiscard]] std::size_t count_large() const;

  const SupervisorSettings& settings_;
};

}  // namespace worker
