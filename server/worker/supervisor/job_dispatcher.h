#pragma once
/// Jobs between the queue and the worker process: claims, assignment, cancellation, previews and results.

#include <atomic>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/queue/queue.h"
#include "server/worker/supervisor/failure_policy.h"
#include "server/worker/supervisor/job_slots.h"
#include "server/worker/supervisor/outcome_writer.h"
#include "server/worker/supervisor/worker_process.h"

namespace worker {

/// Used by the thread of the event loop, except where noted.
class JobDispatcher {
 public:
  JobDispatcher(queue::Queue& queue, const SupervisorSettings& settings, StoreExecutor& executor, LoopEvents& events,
                WorkerProcess& process, OutcomeWriter& outcomes, queue::Log log)
      : queue_(queue),
        settings_(settings),
        executor_(executor),
        events_(events),
        process_(process),
        outcomes_(outcomes),
        log_(std::move(log)) {}

  /// Any thread.
  void on_jobs_available(bool suspects) noexcept;
  [[nodiscard]] int running() const { return running_count_; }
  [[nodiscard]] bool runs(const std::string& id) const { return slots_.running.contains(id); }
  /// No job waits, and none is being claimed.
  [[nodiscard]] bool none_wait() const {
    return claims_.count == 0 && claims_.none_left == notifications_ && claims_.none_left_small == notifications_ &&
           !suspects_first_ && !suspects_available_;
  }

  void claim_jobs(Time now);
  void start_drain() { draining_ = true; }                   ///< claims no more jobs
  [[nodiscard]] bool draining() const { return draining_; }  ///< any thread
  [[nodiscard]] Time next_deadline(Time now) const;          ///< also the end of a pause of claims
  void cancel(const std::string& id);
  void request_preview(const std::string& id, std::uint32_t side);
  void on_lease_lost(const queue::Lease& lease);
  void check_deadlines(Time now);

  void on_message(Message& message);
  /// Returns the number of jobs that it interrupted.
  int on_worker_exit(const WorkerExit& exit);

  /// No job runs, is being claimed or is being stored.
  [[nodiscard]] bool idle() const {
    return slots_.running.empty() && claims_.count == 0 && outcomes_.pending() == 0 && outcomes_.backlog().size() == 0;
  }

 private:
  enum class ClaimKind { any, small, suspect };
  struct ClaimResult {
    ClaimKind kind = ClaimKind::any;
    std::uint64_t notifications = 0;         ///< when the claim began
    std::vector<std::string> busy_owners{};  ///< the same
    std::optional<queue::Claim> claim{};
    Packet assignment{};
    bool failed = false;
  };

  [[nodiscard]] bool has_slot(ClaimKind kind) const;
  void start_claim(ClaimKind kind);
  void on_claimed(ClaimResult& result);
  void stop(RunningJob& job);
  void report_stopped(RunningJob& job);
  std::optional<RunningJob> take(const std::string& id, std::int64_t fence);
  void resolve_in_flight_job(const RunningJob& running, const CrashDecision& decision, const WorkerExit& exit);
  void release(const std::string& id, std::int64_t fence, const queue::Release& release);
  void retry_or_fail(const RunningJob& running, const queue::Problem& problem);

  queue::Queue& queue_;
  const SupervisorSettings& settings_;
  StoreExecutor& executor_;
  LoopEvents& events_;
  WorkerProcess& process_;
  OutcomeWriter& outcomes_;
  const queue::Log log_;

  std::atomic<std::uint64_t> notifications_ = 0;  ///< that jobs are available
  std::atomic<bool> suspects_available_ = true;   ///< also those of an earlier daemon
  std::atomic<int> running_count_ = 0;
  std::atomic<bool> draining_ = false;

  JobSlots slots_{settings_};
  struct {
    std::size_t count = 0, large_count = 0;  ///< in progress; those that may return large jobs
    bool more_wait = false;                  ///< after the latest claim
    /// Values of notifications_ after which no job, or no small job, was left.
    std::optional<std::uint64_t> none_left, none_left_small;
    bool owners_excluded = false;  ///< from a claim that left none
  } claims_;
  std::set<std::string> early_cancels_;  ///< cancelled during claims that may return them
  bool suspects_first_ = false;          ///< suspects may be queued; they run before all other jobs
  Time claims_paused_until_{};
};

}  // namespace worker
