#pragma once
/// The embedded JobStore: one SQLite file, DIRECTORY/whittle.db, in a directory that one process owns.

#include <memory>
#include <string>

#include "server/queue/disk_health.h"
#include "server/queue/job_store.h"

namespace queue {

struct SqliteSettings {
  int read_connections = 4;  ///< reads that run at once; a read takes well under a millisecond, a text search up to 50
  DiskHealth* health = nullptr;  ///< of the disk; null: nobody else is to know. Must outlive the store
};

/// WAL with synchronous = FULL: what was answered survives power loss. Writes share syncs (group commit), so more
/// callers at once mean more writes a second. A copy of the directory made while it runs is not a backup.
class SqliteJobStore final : public JobStore {
 public:
  /// Creates `directory` and the file where missing, brings an older file up to date and takes the directory's lock for
  /// as long as this lives. Throws StoreFailure with a sentence that says why: the directory is in use by another
  /// process, the file is of a newer program, no permission, disk full, ...
  explicit SqliteJobStore(const std::string& directory, SqliteSettings settings = {});
  ~SqliteJobStore() override;  ///< no call may be in progress

  std::optional<KeptReply> insert_job(const InsertRequest& admission, std::int64_t now) override;
  std::optional<KeptReply> reply(const ReplyKey& key, std::int64_t now) override;
  std::optional<Job> find_by_content_key(const std::string& content_key, std::int64_t expires_after) override;
  std::optional<Job> find(const std::string& id) override;
  std::optional<std::string> document(const std::string& id) override;
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit) override;
  std::int64_t count(JobState state) override;
  OwnerUse owner_usage(const std::string& owner) override;
  QueueDepth depth() override;
  std::optional<std::int64_t> queue_position(const std::string& id, std::int64_t limit) override;
  std::optional<Claim> claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until,
                             bool alone) override;
  std::optional<Claim> claim_small(const std::string& boot_id, std::int64_t now, std::int64_t lease_until) override;
  std::vector<Lease> renew(const std::vector<Lease>& leases, std::int64_t until) override;
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<Artifact>& artifacts, bool durable = true,
               const std::vector<SmallImage>& small = {}) override;
  bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) override;
  bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) override;
  bool release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) override;
  CancelOutcome cancel(const std::string& id, std::int64_t now) override;
  Removal remove(const std::string& id) override;
  RetryOutcome retry(const std::string& id, std::int64_t now) override;
  ChangeOutcome change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision) override;
  std::optional<BatchState> find_batch(const std::string& id) override;
  BatchCancel cancel_batch(const std::string& id, std::int64_t now) override;
  BatchRetry retry_batch(const std::string& id, std::int64_t now) override;
  std::vector<std::string> failing_batches() override;
  MaintenanceResult run_maintenance(std::int64_t now, std::int64_t expired_kept_ms, int limit) override;
  int recover(const std::string& boot_id, std::int64_t now) override;
  bool references(const std::string& sha256) override;
  std::optional<std::string> small_image(const std::string& sha256) override;
  void forget_small_image(const std::string& sha256) override;
  bool is_asset_referenced(const std::string& sha256) override;
  void probe() override;

 private:
  /// The least of those that `waiting`, an index and what tells jobs within it, holds.
  std::optional<Claim> claim_of(const char* waiting, const std::string& boot_id, std::int64_t now,
                                std::int64_t lease_until);

  struct Connections;
  std::unique_ptr<Connections> parts_;
};

}  // namespace queue
