#pragma once
/// Where jobs live. Every call that answers without an exception is durable when it returns: it survives kill -9 and
/// power loss (adapters for tests say what they do not keep). Thread-safe. Failures of the environment (disk full, I/O)
/// are thrown as StoreFailure and nothing of the call has happened.

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/jobs/job.h"

namespace jobs {

class StoreFailure : public std::runtime_error {
 public:
  enum class Kind { full, unavailable };
  StoreFailure(Kind which, const std::string& what) : std::runtime_error(what), kind(which) {}
  Kind kind;
};

struct JobFilter {
  std::optional<JobState> state;
  std::map<std::string, std::string> labels;  ///< all must match
  std::string text;                           ///< substring of the name, case-sensitive; empty: any
};

/// Newest first. `next_cursor` is the last id of a full page; empty at the end.
struct JobPage {
  std::vector<Job> items;
  std::string next_cursor;
};

/// A job handed to the worker. `fence` grows with every claim of the job; finish and release with an old one change
/// nothing and answer false, so a worker that was presumed dead cannot overwrite.
struct Claim {
  Job job;
  std::string document;
  std::int64_t fence = 0;
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

  /// Keeps `job` (state queued) with its verbatim document, any bytes. Precondition: the id is new.
  virtual void submit(const Job& job, const std::string& document) = 0;

  virtual std::optional<Job> find(const std::string& id) = 0;
  virtual std::optional<std::string> document(const std::string& id) = 0;
  /// At most `limit` (>= 1) jobs older than `cursor` (empty: from the newest).
  virtual JobPage list(const JobFilter& filter, const std::string& cursor, int limit) = 0;
  virtual std::int64_t count(JobState state) = 0;

  /// The next job to run: highest priority, then oldest; attempt + 1, state running, owned by `boot_id`.
  /// `alone`: only suspects when true, never suspects when false.
  virtual std::optional<Claim> claim(const std::string& boot_id, std::int64_t now, bool alone) = 0;

  /// Ends a running job. False when `fence` is not the latest or the job is not running. A job whose cancel was
  /// requested may still succeed or fail here if the worker was faster; that is told as it is.
  virtual bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                       const std::vector<Artifact>& artifacts) = 0;
  virtual bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) = 0;
  virtual bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) = 0;

  /// Back to queued. `counts`: the attempt was a real failure; otherwise it is given back. `suspect`: see Job; once
  /// set it stays. False as for succeed. A job whose cancel was requested moves to cancelled instead.
  virtual bool release(const std::string& id, std::int64_t fence, std::int64_t now, bool counts, bool suspect) = 0;

  virtual CancelOutcome cancel(const std::string& id, std::int64_t now) = 0;
  virtual Removal remove(const std::string& id) = 0;

  /// At start: everything running under another boot id goes back to queued, its attempt given back (cancel_requested:
  /// to cancelled). Returns how many moved.
  virtual int recover(const std::string& boot_id, std::int64_t now) = 0;

  /// Is this sha256 named by any job's artifacts? Used before an artifact's bytes are deleted.
  virtual bool references(const std::string& sha256) = 0;

  /// Is this upload named by any job? Used before an asset's bytes are deleted.
  virtual bool names_asset(const std::string& sha256) = 0;

  /// Throws StoreFailure when a small write would not be durable now. For readiness.
  virtual void probe() = 0;
};

}  // namespace jobs
