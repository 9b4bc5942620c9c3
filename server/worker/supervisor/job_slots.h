#pragma once
/// The jobs in the worker process, and their division among owners and among large and small jobs.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/worker/supervisor/message_check.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

struct RunningJob {
  using Time = std::chrono::steady_clock::time_point;
  std::string owner;
  std::int64_t fence = 0;
  int attempt = 1, max_attempts = 1;
  ResultRequest requested;
  bool keep = true;                           ///< see queue::Job
  bool cancel_requested = false;              ///< by its owner
  bool large = false;                         ///< see queue::Job
  std::optional<Time> large_since;            ///< it was small before
  bool yields_slot = false;                   ///< it is stopped to be queued again as a large job
  bool lease_lost = false;                    ///< the queue ignores its outcome
  std::optional<queue::Problem> stopped_for;  ///< by the supervisor
  std::optional<std::string> last_preview;    ///< to be kept with its end

  [[nodiscard]] bool is_stopping() const { return yields_slot || cancel_requested || stopped_for || lease_lost; }
  [[nodiscard]] bool keeps_preview() const { return keep && !lease_lost && (cancel_requested || stopped_for); }
};

/// Used by one thread.
class JobSlots {
 public:
  explicit JobSlots(const SupervisorSettings& settings) : settings_(settings) {}

  std::map<std::string, RunningJob> running;  ///< by job id

  /// One slot is never given to a large job, so that small images need not wait for the end of large ones. `claims` may
  /// return large jobs.
  [[nodiscard]] bool has_slot_for_large(std::size_t claims) const;
  /// True if owner_slots jobs of the owner run.
  [[nodiscard]] bool is_busy(const std::string& owner) const;
  [[nodiscard]] std::vector<std::string> busy_owners() const;
  /// The job to queue again because large jobs occupy all slots: the last one that became large. Null if there is none,
  /// or if a job is being stopped already.
  std::pair<const std::string, RunningJob>* surplus_large_job();

 private:
  [[nodiscard]] std::size_t count_large() const;

  const SupervisorSettings& settings_;
};

}  // namespace worker
