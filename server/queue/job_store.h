#pragma once
/// The stores of jobs, as the queue needs them. A call that returns is durable: its effect survives kill -9 and power
/// loss. Exceptions are claims, renewed leases and calls with `durable` = false, which survive kill -9, and power loss
/// from the next durable call on. Thread-safe. A failure of the environment (disk full, I/O) is thrown as StoreFailure,
/// and then the call had no effect; after a failed disk (StoreFailure::Kind::broken) this holds once the store was
/// opened again, and not for StoreFailure::Kind::unknown. Virtual functions are those that tests replace.

#include <cerrno>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/storage/sql/sql_database.h"

namespace queue {

namespace sql = storage::sql;

class StoreFailure : public std::runtime_error {
 public:
  enum class Kind {
    full,
    unavailable,
    broken,   ///< an I/O error: the content of the disk is unknown until it was opened again (disk_health.h)
    unknown,  ///< the connection to the database was lost at a commit, which may have taken place
    damaged,  ///< bytes that were stored are others now
  };
  StoreFailure(Kind which, const std::string& what) : std::runtime_error(what), kind(which) {}
  explicit StoreFailure(const std::string& what) : StoreFailure(Kind::unavailable, what) {}
  /// The kind of a failed call of the operating system, by its errno.
  static Kind kind_of(int error) {
    if (error == ENOSPC || error == EDQUOT || error == EFBIG) return Kind::full;
    return error == EIO ? Kind::broken : Kind::unavailable;
  }
  Kind kind;
};

struct JobFilter {
  std::optional<JobState> state;
  std::map<std::string, std::string> labels;  ///< all must match
  std::string batch;                          ///< id of a batch, or "none": jobs without one; empty: any
  std::string text;                           ///< substring of the name, without the case of ASCII; empty: any
  std::optional<JobKind> kind = {};
  std::optional<std::string> owner = {};
  std::optional<std::int64_t> created_after = {}, created_before = {};  ///< inclusive, exclusive
};

/// Newest first. `next_cursor` is the last id of a full page; empty at the end.
struct JobPage {
  std::vector<Job> items;
  std::string next_cursor;
};

/// A held claim. After its end the job may be taken back (run_maintenance).
struct Lease {
  std::string job_id;
  std::int64_t fence = 0;
  bool operator==(const Lease&) const = default;
};

/// A job handed to the worker. `fence` grows with every claim of the job; a transition with an older one has no effect
/// and returns false, so a worker that was presumed dead cannot overwrite a result.
struct Claim {
  Job job;
  std::string document;
  std::int64_t fence = 0;
  bool is_last = false;  ///< no other job of the requested kind can be claimed now
  /// The scene of the batch, of which `document` is a patch (api::apply_patch).
  std::optional<std::string> scene = std::nullopt;
};

/// Return of a running job to the queue.
struct Release {
  bool counts = false;                 ///< the attempt was a real failure; otherwise it is not counted
  bool suspect = false;                ///< see Job; once set it stays
  bool large = false;                  ///< see Job; once set it stays
  std::int64_t pause_ms = 0;           ///< the job is not claimed again within this time
  std::string code = {}, detail = {};  ///< for JobMove
};

/// Jobs that a claim may return.
struct ClaimFilter {
  bool suspects = false;                   ///< only suspects when true, never suspects when false
  bool small = false;                      ///< only jobs that are not large
  std::vector<std::string> busy_owners{};  ///< owners that run as many jobs as they may: none of theirs
};

enum class ReleaseOutcome {
  stale,  ///< the fence is not the latest, or the job is not running: nothing has changed
  queued,
  cancelled,  ///< as requested
};

/// A reply stored under its key.
struct KeptReply {
  ReplyKey key;
  std::string request_sha256;
  FirstReply reply;
  std::int64_t expires_at = 0;
};

struct NewJob {
  Job job;               ///< queued, or succeeded with the report and artifacts of an equal one
  std::string document;  ///< with InsertRequest::scene its patch
};

/// The owner of a claim and the end of its lease.
struct ClaimTerms {
  std::string boot_id;
  std::int64_t lease_until = 0;
};

/// Rows that are stored together or not at all.
struct InsertRequest {
  std::vector<NewJob> jobs;
  std::optional<Batch> batch = std::nullopt;  ///< contains the jobs
  std::optional<KeptReply> reply = std::nullopt;
  std::optional<CommonScene> scene = std::nullopt;  ///< common to the documents, which are patches of it
  bool durable = true;
};

/// Fields of a job that its owner may change. Unset: unchanged.
struct JobChange {
  std::optional<int> priority;
  std::optional<std::string> name;
  std::optional<std::map<std::string, std::string>> labels;
  std::optional<std::optional<std::int64_t>> expires_at;
};
/// `ended`: its priority is final. `expired`: its expires_at is final.
enum class ChangeOutcome { changed, other_revision, ended, expired, unknown };
enum class CancelOutcome { cancelled, cancelling, already_ended, unknown };
enum class SucceededJobs { keep, retry };
enum class RetryOutcome { queued, not_ended, succeeded, expired, unknown };
enum class RemoveOutcome { removed, running, unknown };

/// `artifacts`: named by the removed job; they may be deleted where no other job names them.
struct Removal {
  RemoveOutcome outcome = RemoveOutcome::unknown;
  std::vector<Artifact> artifacts;
  JobSummary job = {};  ///< the removed job
};

/// Jobs of a batch that a cancel changed.
struct BatchCancel {
  std::vector<std::string> cancelled;   ///< were queued
  std::vector<std::string> cancelling;  ///< run
};

/// Jobs of a batch that a retry queued again.
struct BatchRetry {
  std::vector<std::string> jobs;
  bool suspects = false;  ///< there are suspects among them
};

/// Newest first, as JobPage.
struct BatchPage {
  std::vector<BatchState> items;
  std::string next_cursor;
};

/// Jobs of a batch that were removed, and the artifacts that they named.
struct BatchRemoval {
  std::vector<JobSummary> jobs;
  std::vector<Artifact> artifacts;
};

struct OwnerUsage {
  std::int64_t queued_jobs = 0;
  std::int64_t artifact_bytes = 0;   ///< images of all jobs; equal images count once for each job
  std::int64_t all_queued_jobs = 0;  ///< those of all owners
};

struct QueueDepth {
  std::map<int, std::int64_t> queued_by_priority;
  std::int64_t delayed = 0;               ///< queued jobs with not_before
  std::int64_t work = 0;                  ///< Job::work of the other queued jobs
  std::optional<std::int64_t> oldest_at;  ///< since then the oldest job that may run has waited
};

/// Jobs that are claimed before another one.
struct JobsBefore {
  std::int64_t jobs = 0, work = 0;  ///< number, and sum of Job::work
};

/// Limits of what is kept of ended jobs. Unset: no limit.
struct Retention {
  std::int64_t lease_grace_ms = 0;                ///< leases are taken back this long after their end
  std::int64_t expired_ms = 0;                    ///< rows of expired jobs
  std::int64_t unkept_ms = 3000;                  ///< jobs without Job::keep, so that their clients can read the result
  std::optional<std::int64_t> succeeded_ms = {};  ///< time from the end to the expiry
  std::optional<std::int64_t> failed_ms = {};     ///< the same of failed and cancelled jobs
  std::optional<std::int64_t> artifact_bytes = {};  ///< all artifacts; the jobs that ended first expire
};

/// Result of one step of run_maintenance.
struct MaintenanceResult {
  std::vector<std::string> overdue;    ///< queued jobs that failed because their deadline has passed
  std::vector<std::string> abandoned;  ///< running jobs whose lease has ended: queued again, the attempt not counted
  std::vector<std::string> cancelled;  ///< the same, cancelled as requested
  bool due = false;                    ///< jobs whose not_before has passed may be claimed now
  bool suspects_due = false;           ///< there are suspects among them
  int expired = 0;                     ///< ended jobs that lost their document and images at expires_at,
  int aged = 0;                        ///< by Retention::succeeded_ms and failed_ms,
  int evicted = 0;                     ///< and by Retention::artifact_bytes
  int deleted = 0;                     ///< jobs and replies
  std::vector<Artifact>
      artifacts;      ///< named by the expired and deleted jobs; may be deleted where no other job names them
  bool more = false;  ///< the step was too small for all of it
};

/// Rows of jobs.
class JobStore {
 public:
  explicit JobStore(sql::Transactions& transactions) : transactions_(transactions) {}
  virtual ~JobStore() = default;

  /// Returns the reply that is stored under the same key already; then nothing was inserted. Precondition: the ids are
  /// new.
  virtual std::optional<KeptReply> insert(const InsertRequest& request, std::int64_t now);
  /// The stored reply, unless it has expired.
  std::optional<KeptReply> find_reply(const ReplyKey& key, std::int64_t now);
  std::optional<Job> find(const std::string& id);
  std::optional<JobSummary> summary(const std::string& id);
  /// The latest moves_max moves of a job with Job::keep, oldest first, without its submission.
  std::vector<JobMove> moves(const std::string& id);
  /// The newest succeeded job with this content key that expires after `expires_after` or never.
  std::optional<Job> find_by_content_key(const std::string& content_key, std::int64_t expires_after);
  std::optional<std::string> document(const std::string& id);  ///< as it was inserted
  /// The scene of the batch that the document is a patch of; none if it is complete.
  std::optional<std::string> scene(const std::string& id);
  /// At most `limit` (>= 1) jobs with Job::keep, older than `cursor` (empty: from the newest).
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit);
  /// Changes all fields or none. With `revision`: only while the job has that one.
  ChangeOutcome change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision,
                       bool durable = true);
  Removal remove(const std::string& id, bool durable = true);

 private:
  sql::Transactions& transactions_;
};

/// Counts over all jobs, without a walk over them: from tables that triggers maintain.
class JobStatistics {
 public:
  explicit JobStatistics(sql::Transactions& transactions) : transactions_(transactions) {}

  std::int64_t count(JobState state);
  OwnerUsage owner_usage(const std::string& owner);
  std::int64_t artifact_bytes();  ///< sum over all jobs; equal artifacts count once
  QueueDepth depth();
  /// Jobs that would be claimed before this one if all were claimed now, one after the other, and owners had no running
  /// jobs; counted up to `limit`. Empty where it is not queued or has a not_before.
  std::optional<JobsBefore> queue_position(const std::string& id, std::int64_t limit);

 private:
  sql::Transactions& transactions_;
};

/// Moves of jobs between states (may_move).
class JobTransitions {
 public:
  explicit JobTransitions(sql::Transactions& transactions) : transactions_(transactions) {}
  virtual ~JobTransitions() = default;

  /// The next job to run, of those that pass the filter, have no not_before (run_maintenance clears it in time) and a
  /// deadline later than `now`. It becomes running under the terms, attempt + 1. Power loss may undo a claim; the job
  /// is then queued, as it is after any end of the daemon that claimed it.
  ///
  /// First the owner is chosen: the one with the fewest running jobs for its weight, so that an owner without any is
  /// next; of equal ones the one with the least pass (stride scheduling, Waldspurger and Weihl 1995). A claim increases
  /// the pass of its owner by 1 / weight, and the pass of an owner that was idle counts as that of the latest claim, so
  /// that idle time gives no credit. Then the owner's job: least rank (rank_of), then oldest.
  virtual std::optional<Claim> claim(const ClaimTerms& terms, std::int64_t now, const ClaimFilter& filter);
  /// Extends the leases that still hold to `until`, also those that have ended and were not taken back yet. Returns the
  /// others: their jobs have ended or were released. One small write for all of them.
  virtual std::vector<Lease> renew(const std::vector<Lease>& leases, std::int64_t until);

  /// The next three return false when `fence` is not the latest or the job is not running. A job whose cancel was
  /// requested may still succeed or fail if the worker was faster.
  /// Not `rendered`: with the result of an equal job; the attempt does not count.
  virtual bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                       const std::vector<Artifact>& artifacts, bool durable = true, bool rendered = true);
  bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem);
  bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now);
  /// Adds an artifact to a job that failed or was cancelled under this fence, is kept and has not expired. False
  /// otherwise.
  bool add_artifact(const std::string& id, std::int64_t fence, const Artifact& artifact);
  virtual ReleaseOutcome release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& release);

  CancelOutcome cancel(const std::string& id, std::int64_t now, bool durable = true);
  /// Queues a failed or cancelled job again as if it were new, except for its id, its document and `suspect`: attempts
  /// begin anew, problem, expires_at and a passed deadline are cleared.
  /// A succeeded one only as requested; its report and artifacts are then deleted.
  RetryOutcome retry(const std::string& id, std::int64_t now, SucceededJobs succeeded = SucceededJobs::keep,
                     bool durable = true);

 private:
  sql::Transactions& transactions_;
};

/// Jobs submitted together. A batch is deleted with the last of its jobs.
class BatchStore {
 public:
  explicit BatchStore(sql::Transactions& transactions) : transactions_(transactions) {}

  std::optional<BatchState> find(const std::string& id);
  BatchPage list(const std::string& cursor, int limit);  ///< see JobStore::list
  /// Removes at most `limit` jobs that have ended; see JobStore::remove().
  BatchRemoval remove_ended(const std::string& id, int limit);
  /// Cancels all jobs of the batch; see JobTransitions::cancel().
  BatchCancel cancel(const std::string& id, std::int64_t now);
  /// Retries all failed or cancelled jobs that have not expired; see JobTransitions::retry().
  BatchRetry retry(const std::string& id, std::int64_t now);
  /// Batches with more failed jobs than their max_failed and jobs that have not ended.
  std::vector<std::string> list_failing();

 private:
  sql::Transactions& transactions_;
};

class MaintenanceStore {
 public:
  explicit MaintenanceStore(sql::Transactions& transactions) : transactions_(transactions) {}
  virtual ~MaintenanceStore() = default;

  /// One small step, at most `limit` jobs of each kind: running jobs whose lease has ended are released, not_before
  /// that has passed is cleared, earliest first; queued jobs past their deadline fail; ended ones past expires_at, and
  /// those beyond the retention, expire: they lose their document and images. Rows of expired jobs and replies are
  /// deleted in time, and ended jobs without Job::keep. Costs one read when there is nothing to do.
  virtual MaintenanceResult run_maintenance(std::int64_t now, const Retention& retention, int limit);

  /// At the start of a daemon: every job that runs under another boot id returns to queued, the attempt not counted
  /// (cancel_requested: to cancelled), whatever its lease. Returns their number. Jobs without Job::keep are cancelled:
  /// their clients are gone. For a store with one daemon at a time;
  /// where several share one this has no effect and leases end in time.
  int recover(const std::string& boot_id, std::int64_t now);

  /// True if a job names this sha256 in its artifacts, or as an upload. Called before the bytes are deleted.
  bool is_artifact_referenced(const std::string& sha256);
  bool is_asset_referenced(const std::string& sha256);

  /// A small durable write, which makes all earlier calls durable too. Throws StoreFailure when it fails.
  virtual void probe();

 private:
  sql::Transactions& transactions_;
};

/// References to one of each; they must outlive their user.
struct Stores {
  JobStore& jobs;
  JobStatistics& statistics;
  JobTransitions& transitions;
  BatchStore& batches;
  MaintenanceStore& maintenance;
};

/// One of each, over an SQL database whose tables must exist: see the schemas of server/storage/sqlite and
/// server/storage/postgres. `transactions` must outlive it.
class JobStores {
 public:
  explicit JobStores(sql::Transactions& transactions)
      : jobs_(transactions),
        statistics_(transactions),
        transitions_(transactions),
        batches_(transactions),
        maintenance_(transactions) {}
  [[nodiscard]] Stores all() { return {jobs_, statistics_, transitions_, batches_, maintenance_}; }

 private:
  JobStore jobs_;
  JobStatistics statistics_;
  JobTransitions transitions_;
  BatchStore batches_;
  MaintenanceStore maintenance_;
};

}  // namespace queue
