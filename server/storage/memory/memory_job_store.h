#pragma once
/// A JobStore for tests: everything in this process's memory, nothing survives it. Otherwise it keeps every promise of
/// the port and passes the same conformance suite. Tests derive from it to make it fail.

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "server/queue/job_store.h"

namespace queue {

class MemoryJobStore : public JobStore {
 public:
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
  void probe() override {}

 private:
  struct Row {
    Job job;
    std::string document;
    std::int64_t fence = 0;
    std::string boot_id;
    std::int64_t rank = 0;
    std::int64_t lease_until = 0;  ///< while it runs
  };
  std::optional<Claim> claim_of(const std::function<bool(const Job&)>& wanted, const std::string& boot_id,
                                std::int64_t now, std::int64_t lease_until);
  static CancelOutcome cancel(Row& row, std::int64_t now);
  static RetryOutcome retry(Row& row, std::int64_t now);
  std::map<std::string, Row>::iterator erase(std::map<std::string, Row>::iterator row);
  std::optional<BatchState> state_of_batch(const std::string& id) const;
  static void give_back(Job& job, std::int64_t now, const Release& how);
  bool is_named(const std::string& sha256) const;
  Row* running(const std::string& id, std::int64_t fence);
  std::optional<KeptReply> kept(const ReplyKey& key, std::int64_t now) const;
  void take_back_abandoned(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep);
  void let_due_jobs_run(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep);
  void fail_overdue(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep);
  void expire(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep);
  void forget(std::int64_t now, std::int64_t expired_kept_ms, std::size_t limit, MaintenanceResult& upkeep);

  std::mutex mutex_;
  std::map<std::string, Row> rows_;                  ///< by id, so by creation
  std::map<std::string, std::string> small_images_;  ///< by sha256
  std::map<ReplyKey, KeptReply> replies_;
  std::map<std::string, Batch> batches_;
};

}  // namespace queue
