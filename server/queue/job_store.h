#pragma once
/// Where jobs live. Every call that answers without an exception is durable when it returns: it survives kill -9 and
/// power loss (adapters for tests say what they do not keep). Only claims, leases and what is not to be `durable` wait
/// for no disk: they survive kill -9, and power loss with the next call that is durable. Thread-safe. Failures of the
/// environment (disk full, I/O) are thrown as StoreFailure and nothing of the call has happened; after a broken disk a
/// new opening tells whether.

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/queue/submission.h"

namespace queue {

class StoreFailure : public std::runtime_error {
 public:
  enum class Kind {
    full,
    unavailable,
    broken,  ///< the disk failed (EIO): what it holds is known again when it was opened anew (disk_health.h)
  };
  StoreFailure(Kind which, const std::string& what) : std::runtime_error(what), kind(which) {}
  Kind kind;
};

struct JobFilter {
  std::optional<JobState> state;
  std::map<std::string, std::string> labels;  ///< all must match
  std::string batch;                          ///< id of a batch; empty: any
  std::string text;                           ///< substring of the name, case-sensitive; empty: any
};

/// Newest first. `next_cursor` is the last id of a full page; empty at the end.
struct JobPage {
  std::vector<Job> items;
  std::string next_cursor;
};

/// A claim that is held: until its end the job is whose claimed it, afterwards it may be taken back (run_maintenance).
struct Lease {
  std::string job_id;
  std::int64_t fence = 0;
  bool operator==(const Lease&) const = default;
};

/// A job handed to the worker. `fence` grows with every claim of the job; finish and release with an old one change
/// nothing and answer false, so a worker that was presumed dead cannot overwrite.
struct Claim {
  Job job;
  std::string document;
  std::int64_t fence = 0;
};

/// How a running job goes back to the queue.
struct Release {
  bool counts = false;   ///< the attempt was a real failure; otherwise it is given back
  bool suspect = false;  ///< see Job; once set it stays
  std::optional<std::int64_t> not_before = std::nullopt;  ///< see Job
};

/// A reply kept under its key, and until when.
struct KeptReply {
  ReplyKey key;
  std::string request_sha256;
  FirstReply reply;
  std::int64_t expires_at = 0;
};

struct NewJob {
  Job job;  ///< queued, or succeeded with the report and artifacts of an equal one
  std::string document;
};
/// An image that stands beside the rows which name it: stored with them in one go, in no file of its own.
struct SmallImage {
  std::string sha256;
  std::string bytes;
};

/// What is stored together or not at all.
struct InsertRequest {
  std::vector<NewJob> jobs;
  std::optional<Batch> batch;  ///< whose jobs they are
  std::optional<KeptReply> reply;
  bool durable = true;  ///< false: nobody was promised that they survive power loss; they do with the next call that is
};

/// What an owner may change of a job. Unset: stays.
struct JobChange {
  std::optional<int> priority;
  std::optional<std::string> name;
  std::optional<std::map<std::string, std::string>> labels;
  std::optional<std::optional<std::int64_t>> expires_at;
};
/// `ended`: its priority cannot change any more. `expired`: its expires_at cannot.
enum class ChangeOutcome { changed, other_revision, ended, expired, unknown };

/// The jobs of a batch that a cancel changed.
struct BatchCancel {
  std::vector<std::string> cancelled;   ///< were queued
  std::vector<std::string> cancelling;  ///< run
};

/// The jobs of a batch that a retry queued again.
struct BatchRetry {
  std::vector<std::string> jobs;
  bool suspects = false;  ///< some of them are
};

enum class RetryOutcome { queued, not_ended, succeeded, expired, unknown };

/// What an owner takes of the store.
struct OwnerUse {
  std::int64_t queued_jobs = 0;
  std::int64_t artifact_bytes = 0;  ///< of all jobs, equal images counted once for each
};

/// Jobs that wait, and how long they have.
struct QueueDepth {
  std::map<int, std::int64_t> queued_by_priority;
  std::int64_t delayed = 0;               ///< of the queued ones those that must not run yet
  std::optional<std::int64_t> oldest_at;  ///< since when the one that could run longest has waited
};

/// What a step of keeping house did.
struct MaintenanceResult {
  std::vector<std::string> overdue;    ///< queued jobs whose deadline has passed: they failed
  std::vector<std::string> abandoned;  ///< running jobs whose lease has ended: given back, as by `release` at no cost
  bool due = false;                    ///< jobs whose not_before has passed: it is unset, they may be claimed
  bool suspects_due = false;           ///< some of them are suspects
  int expired = 0;                     ///< ended jobs that lost their document and images
  int forgotten = 0;                   ///< jobs and replies that are no longer there at all
  std::vector<Artifact> artifacts;     ///< named by those: may be deleted where no other job names them
  bool more = false;                   ///< the step was too small for all of it
};

enum class CancelOutcome { cancelled, cancelling, already_ended, unknown };
enum class RemoveOutcome { removed, running, unknown };

/// What removing did, and the artifacts that the job named: whoever removed it may delete those nobody names now.
struct Removal {
  RemoveOutcome outcome = RemoveOutcome::unknown;
  std::vector<Artifact> artifacts;
};

class JobStore {
 public:
  virtual ~JobStore() = default;

  /// Keeps jobs with their verbatim documents, any bytes, and the reply. Precondition: the ids are new. When another
  /// reply is kept under the same key already that is returned, and nothing is stored.
  virtual std::optional<KeptReply> insert_job(const InsertRequest& admission, std::int64_t now) = 0;
  void submit(const Job& job, const std::string& document) { insert_job({{{job, document}}, {}, {}}, job.created_at); }

  /// Nothing where none is kept or it has expired.
  virtual std::optional<KeptReply> reply(const ReplyKey& key, std::int64_t now) = 0;
  /// The newest job that succeeded with this content key, has not expired and does not before `expires_after`.
  virtual std::optional<Job> find_by_content_key(const std::string& content_key, std::int64_t expires_after) = 0;

  virtual std::optional<Job> find(const std::string& id) = 0;
  virtual std::optional<std::string> document(const std::string& id) = 0;
  /// At most `limit` (>= 1) jobs older than `cursor` (empty: from the newest).
  virtual JobPage list(const JobFilter& filter, const std::string& cursor, int limit) = 0;
  virtual std::int64_t count(JobState state) = 0;
  virtual OwnerUse owner_usage(const std::string& owner) = 0;
  virtual QueueDepth depth() = 0;
  /// How many jobs would be claimed before this one; at most `limit` are counted. Nothing where it does not wait or
  /// must not run yet.
  virtual std::optional<std::int64_t> queue_position(const std::string& id, std::int64_t limit) = 0;

  /// The next job to run: least rank (rank_of), then oldest, of those without not_before (run_maintenance unsets it in
  /// time) whose deadline is later than `now`; attempt + 1, state running, owned by `boot_id` until `lease_until`.
  /// `alone`: only suspects when true, never suspects when false. A power cut may undo it: then the job is queued, as
  /// it is after any end of the daemon that claimed it.
  virtual std::optional<Claim> claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until,
                                     bool alone) = 0;
  /// As claim without `alone`, of the jobs that are not large; however many large ones wait before them.
  virtual std::optional<Claim> claim_small(const std::string& boot_id, std::int64_t now, std::int64_t lease_until) = 0;

  /// Leases that still hold end at `until` from now on, also those that have ended and were not taken back yet. Returns
  /// the others: their jobs have ended, or were given back. One small write for all of them.
  virtual std::vector<Lease> renew(const std::vector<Lease>& leases, std::int64_t until) = 0;

  /// Ends a running job. False when `fence` is not the latest or the job is not running. A job whose cancel was
  /// requested may still succeed or fail here if the worker was faster; that is told as it is. `small`: the bytes of
  /// those `artifacts` that are in no ArtifactStore; equal ones are kept once for all jobs.
  virtual bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                       const std::vector<Artifact>& artifacts, bool durable = true,
                       const std::vector<SmallImage>& small = {}) = 0;
  virtual bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) = 0;
  virtual bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) = 0;

  /// Back to queued. False as for succeed. A job whose cancel was requested moves to cancelled instead.
  virtual bool release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) = 0;

  virtual CancelOutcome cancel(const std::string& id, std::int64_t now) = 0;
  virtual Removal remove(const std::string& id) = 0;

  /// A failed or cancelled job is queued again, as if it had just been submitted but for its id, its document and
  /// whether it is suspect: attempts begin anew, problem and expires_at are gone, a deadline that has passed too.
  virtual RetryOutcome retry(const std::string& id, std::int64_t now) = 0;
  /// All of it or nothing. With `revision`: only while the job has that one.
  virtual ChangeOutcome change(const std::string& id, const JobChange& change,
                               std::optional<std::int64_t> revision) = 0;

  /// A batch goes with the last of its jobs.
  virtual std::optional<BatchState> find_batch(const std::string& id) = 0;
  /// As cancel, of all jobs of a batch.
  virtual BatchCancel cancel_batch(const std::string& id, std::int64_t now) = 0;
  /// As retry, of all that failed or were cancelled and have not expired.
  virtual BatchRetry retry_batch(const std::string& id, std::int64_t now) = 0;
  /// Batches with more failed jobs than their max_failed, and others that have not ended.
  virtual std::vector<std::string> failing_batches() = 0;

  /// One small step of keeping house, at most `limit` jobs of each kind: running ones whose lease has ended are given
  /// back, those whose not_before has passed may run, earliest first; queued jobs past their deadline fail, ended ones
  /// past expires_at lose their document and images and, `expired_kept_ms` later, go; so do replies past theirs.
  /// Costs nothing but a read when there is nothing to do.
  virtual MaintenanceResult run_maintenance(std::int64_t now, std::int64_t expired_kept_ms, int limit) = 0;

  /// At start: everything running under another boot id goes back to queued, its attempt given back (cancel_requested:
  /// to cancelled), whatever its lease. Returns how many moved. For stores that one daemon at a time has: it knows that
  /// the others are dead. Where several share one nothing moves: leases end by themselves.
  virtual int recover(const std::string& boot_id, std::int64_t now) = 0;

  /// Is this sha256 named by any job's artifacts? Used before an artifact's bytes are deleted.
  virtual bool references(const std::string& sha256) = 0;

  /// The bytes of a small image; nothing where there is none of this name.
  virtual std::optional<std::string> small_image(const std::string& sha256) = 0;
  /// Deletes them unless a job names them. May be undone by a power cut.
  virtual void forget_small_image(const std::string& sha256) = 0;

  /// Is this upload named by any job? Used before an asset's bytes are deleted.
  virtual bool is_asset_referenced(const std::string& sha256) = 0;

  /// Throws StoreFailure when a small write would not be durable now. For readiness.
  virtual void probe() = 0;
};

}  // namespace queue
