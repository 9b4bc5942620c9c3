#pragma once
/// The interfaces of the queue to observers: of all jobs, and of the ends of jobs with webhooks.

#include <cstdint>
#include <optional>
#include <string>

#include "api/document.h"
#include "api/report.h"
#include "server/queue/job.h"

namespace queue {

/// The end of a job. The daemon that ran it sets all fields.
struct EndedJob {
  /// Unix ms. `started_at` is that of the last attempt.
  struct Run {
    std::int64_t created_at = 0, started_at = 0, ended_at = 0;
  };
  std::string id;
  JobState state = JobState::succeeded;
  /// None where no worker ran it: cancelled before, or the images of an equal job.
  std::optional<Run> run = std::nullopt;
  std::optional<api::ReportFigures> figures = std::nullopt;  ///< figures of a job that succeeded in this run
};

/// Called from any thread, after the change is durable. The calls return at once and do not call the queue.
class JobObserver {
 public:
  virtual ~JobObserver() = default;
  /// The job is about to be stored, or was changed. Not called for jobs of earlier runs of the daemon.
  virtual void on_described(const JobSummary& /*job*/) noexcept {}
  /// Also to queued, when the job is new.
  virtual void on_state_changed(const std::string& id, JobState to) noexcept = 0;
  /// After on_state_changed to an end, when all waiters for the job were called: the place for slower work.
  virtual void on_waiters_notified(const EndedJob& /*job*/) noexcept {}
  virtual void on_progress(const std::string& /*id*/, double /*fraction*/) noexcept {}
  virtual void on_removed(const JobSummary& /*job*/) noexcept {}
  /// The results so far of a running measurement, as its report.
  virtual void on_measurement(const std::string& /*id*/, const std::string& /*summary*/) noexcept {}
  /// That number of ended jobs lost their documents and images; `reason`: "expires_at", "age" or "artifact_bytes".
  virtual void on_expired(const char* /*reason*/, int /*jobs*/) noexcept {}
};

/// For the webhooks of jobs. Called from any thread.
class CompletionListener {
 public:
  virtual ~CompletionListener() = default;

  /// Called before the job `id` with this webhook is stored. Durable when it returns; throws StoreFailure, and then the
  /// job is not stored.
  virtual void register_webhook(const std::string& id, const api::Webhook& webhook) = 0;

  /// The job has ended or was removed. Returns at once. Ends before a restart are not repeated.
  virtual void on_ended(const std::string& id) noexcept = 0;
};

}  // namespace queue
