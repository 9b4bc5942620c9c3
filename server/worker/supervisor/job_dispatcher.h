#pragma once
/// Jobs between the queue and the worker process: claims, assignment, cancellation, previews and results.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "server/queue/queue.h"
#include "server/worker/supervisor/crash_policy.h"
#include "server/worker/supervisor/deadlines.h"
#include "server/worker/supervisor/outcome_writer.h"
#include "server/worker/supervisor/worker_process.h"

namespace worker {

/// Used by the thread of the event loop, except where noted.
class JobDispatcher {
 public:
  using Time = Deadlines::Time;
  JobDispatcher(queue::Queue& queue, const SupervisorSettings& settings, StoreExecutor& executor, LoopEvents& events,
                WorkerProcess& process, Deadlines& deadlines, OutcomeWriter& outcomes, queue::Log log)
      : queue_(queue),
        settings_(settings),
        executor_(executor),
        events_(events),
        process_(process),
        deadlines_(deadlines),
        outcomes_(outcomes),
        log_(std::move(log)) {}

  /// Any thread.
  void on_jobs_available(bool suspects) noexcept;
  [[nodiscard]] int running() const { return running_count_; }

  void claim_jobs(Time now);
  [[nodiscard]] Time next_claim(Time now) const;  ///< the end of a pause
  void cancel(const std::string& id);
  void request_preview(const std::string& id, std::uint32_t side);
  void on_lease_lost(const queue::Lease& lease);
  void check_deadlines(Time now);

  void on_message(Message& message);
  /// Returns the number of jobs that it interrupted.
  int on_worker_exit(const WorkerExit& exit);

  /// No job runs, is being claimed or is being stored.
  [[nodiscard]] bool idle() const { return running_.empty() && claiming_ == 0 && outcomes_.pending() == 0; }

 private:
  struct RunningJob {
    std::int64_t fence = 0;
    int attempt = 1, max_attempts = 1;
    bool cancel_requested = false;              ///< by its owner
    bool large = false;                         ///< see queue::Job
    bool lease_lost = false;                    ///< the queue ignores its outcome
    std::optional<queue::Problem> stopped_for;  ///< by the supervisor
  };

  enum class ClaimKind { any, small, suspect };
  struct ClaimResult {
    ClaimKind kind = ClaimKind::any;
    std::uint64_t notifications = 0;  ///< when the claim began
    std::optional<queue::Claim> claim{};
    Packet assignment{};
    bool failed = false;
  };

  [[nodiscard]] bool has_slot(ClaimKind kind) const;
  void start_claim(ClaimKind kind);
  void run_claim(ClaimResult result) noexcept;
  void on_claimed(ClaimResult& result);
  void start_job(ClaimResult& result);
  void stop(const std::string& id);
  void report_stopped(const std::string& id, const RunningJob& job);
  std::optional<RunningJob> take(const std::string& id, std::int64_t fence);
  void on_finished(Finished& message);
  void on_cancelled(const Cancelled& message);
  void resolve_in_flight_job(const InFlightJob& job, const CrashDecision& decision, const std::string& code);
  void release(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::chrono::milliseconds pause);
  void retry_or_fail(const std::string& id, const RunningJob& job, const queue::Problem& problem);

  queue::Queue& queue_;
  const SupervisorSettings& settings_;
  StoreExecutor& executor_;
  LoopEvents& events_;
  WorkerProcess& process_;
  Deadlines& deadlines_;
  OutcomeWriter& outcomes_;
  const queue::Log log_;

  std::atomic<std::uint64_t> notifications_ = 0;  ///< that jobs are available
  std::atomic<bool> suspects_available_ = true;   ///< also those of an earlier daemon
  std::atomic<int> running_count_ = 0;

  std::map<std::string, RunningJob> running_;
  std::size_t claiming_ = 0, claiming_any_ = 0;  ///< claims in progress; those that may return large jobs
  std::size_t found_in_a_row_ = 0;               ///< jobs, by the latest claims
  std::set<std::string> early_cancels_;          ///< cancelled during claims that may return them
  /// Values of notifications_ at which a claim of this kind found nothing.
  std::optional<std::uint64_t> found_none_, found_none_small_;
  bool suspects_first_ = false;  ///< suspects may be queued; they run before all other jobs
  Time claims_paused_until_{};
};

}  // namespace worker
