#pragma once
/// What the HTTP room asks of the queue. One object, thread-safe; it knows neither HTTP nor SQL nor the worker process.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/queue/artifact_store.h"
#include "server/queue/job.h"
#include "server/queue/job_store.h"
#include "server/queue/previews.h"
#include "server/queue/submission.h"
#include "tracer/result.h"

namespace queue {

/// What GET /v1/queue tells.
struct QueueState {
  QueueDepth depth;
  std::map<JobState, std::int64_t> jobs;  ///< by state, all of them
  std::optional<double> oldest_age_s;     ///< of those that could run
  /// When all that waits now will have ended, reckoned from how fast jobs ended lately; nothing until two have.
  std::optional<double> eta_s;
};

class JobService {
 public:
  virtual ~JobService() = default;

  /// Durable when it returns. Where the result cache has the images, the job has ended at once. With an idempotency
  /// key a request that came before is not done again: its first reply is told.
  virtual tracer::Result<Submitted, Refused> submit(Submission submission) = 0;

  virtual std::optional<JobView> find(const std::string& id) = 0;
  virtual JobPage list(const JobFilter& filter, const std::string& cursor, int limit) = 0;
  virtual double progress(const std::string& id) = 0;

  /// Queued: cancelled at once. Running: the worker is told; the job moves within 100 ms.
  virtual CancelOutcome cancel(const std::string& id) = 0;
  virtual RemoveOutcome remove(const std::string& id) = 0;
  virtual RetryOutcome retry(const std::string& id) = 0;  ///< as JobStore::retry
  /// As JobStore::change.
  virtual ChangeOutcome change(const std::string& id, const JobChange& change,
                               std::optional<std::int64_t> revision) = 0;
  virtual QueueState state() = 0;

  /// As submit; a bound holds for all jobs together.
  virtual tracer::Result<BatchSubmitted, Refused> submit_batch(BatchSubmission submission) = 0;
  virtual std::optional<BatchState> find_batch(const std::string& id) = 0;
  virtual void cancel_batch(const std::string& id) = 0;  ///< as cancel, of those that have not ended
  virtual int retry_batch(const std::string& id) = 0;    ///< as JobStore::retry_batch; how many

  /// A job that was submitted without being durable is from now on.
  virtual void make_durable(const std::string& id) = 0;

  virtual std::unique_ptr<ArtifactReader> open(const Artifact& artifact) = 0;

  /// Calls `done` once, from any thread, when the job has ended (at once, from this thread, if it has or does not
  /// exist). `done` must be quick and must not throw. Returns a token for `forget`.
  virtual std::uint64_t when_ended(const std::string& id, std::function<void()> done) = 0;
  virtual void forget(std::uint64_t token) = 0;

  /// A running job's image as far as it was made, at most `side` (<= preview_side_max) pixels wide and high.
  virtual Previews::Latest preview(const std::string& id, std::uint32_t side) = 0;
  /// Asks for a newer one. Calls `done` once, from any thread, when it is there or the job does not run any more; where
  /// that was so before, never. As for when_ended. Returns a token for `cancel_preview`.
  virtual std::uint64_t look(const std::string& id, std::uint32_t side, std::function<void()> done) = 0;
  virtual void cancel_preview(std::uint64_t token) = 0;

  /// For readiness: empty when all is well, else why not ("store: disk full", "worker: restarting", "draining").
  /// Costs a small durable write: not to be asked more than about once a second.
  virtual std::string not_ready() = 0;
};

}  // namespace queue
