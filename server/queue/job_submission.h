#pragma once
/// Submission of jobs: within the quotas, once for each Idempotency-Key, from the result cache where that has the
/// images.

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "server/queue/queue_context.h"
#include "server/queue/submission.h"
#include "tracer/result.h"

namespace queue {

/// Thread-safe. Every call may throw StoreFailure.
class JobSubmission {
 public:
  explicit JobSubmission(QueueContext& context) : context_(context) {}

  /// Durable when it returns, unless the submission is not. With images in the result cache the job has succeeded
  /// already. A repeated request returns its first reply.
  tracer::Result<Submitted, Rejection> submit(Submission submission);
  /// As submit; a limit holds for all jobs together.
  tracer::Result<BatchSubmitted, Rejection> submit_batch(BatchSubmission submission);
  /// Makes a job that was submitted without durability durable, and its later images. The caller reads the job again
  /// afterwards: one that has ended meanwhile is not durable.
  void make_durable(const std::string& id);

 private:
  class QuotaReservation;
  std::optional<Rejection> reserve(const std::string& owner, std::int64_t jobs);
  void release(const std::string& owner, std::int64_t jobs);
  Job job_of(const Submission& submission);
  bool finish_from_cache(Job& job, ArtifactPins::Pinned& pinned, bool durable);
  NewJob new_job(Submission submission, ArtifactPins::Pinned& pinned);
  std::optional<KeptReply> insert(InsertRequest& request, const Job& job);
  void notify_stored(const Job& job);

  QueueContext& context_;
  std::mutex mutex_;
  std::map<std::string, std::int64_t> reserved_;  ///< jobs by owner: admitted, not yet counted by the store
};

}  // namespace queue
