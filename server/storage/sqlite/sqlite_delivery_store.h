#pragma once
/// The embedded DeliveryStore: one SQLite file of its own, DIRECTORY/webhooks.db, so that deliveries
/// never delay the commits of jobs.

#include <memory>
#include <set>
#include <string>

#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"

namespace storage::sqlite {

class GroupCommit;

/// As check_jobs_file.
void check_deliveries_file(const std::string& directory);

/// WAL with synchronous = FULL over a single connection; calls that wait at once share a commit.
class SqliteDeliveryStore final : public queue::DeliveryStore {
 public:
  /// Creates the file where missing. Precondition: this process holds the directory's lock (SqliteStores). Throws
  /// StoreFailure, also for a file with another schema. `health` is that of the disk; null: private to this store.
  explicit SqliteDeliveryStore(const std::string& directory, queue::DiskHealth* health = nullptr);
  ~SqliteDeliveryStore() override;

  void subscribe(const queue::Subscription& subscription) override;
  std::optional<queue::Subscription> subscription(const std::string& job_id) override;
  std::vector<std::string> subscribed_jobs() override;
  void unsubscribe(const std::string& job_id) override;
  void enqueue(const queue::Delivery& delivery) override;
  std::optional<queue::Delivery> next(const std::set<std::string>& busy) override;
  void record_attempt(const std::string& id, const queue::DeliveryAttempt& attempt, queue::DeliveryState state,
                      std::optional<std::int64_t> next_attempt_at) override;
  std::vector<queue::Delivery> of_job(const std::string& job_id) override;
  bool redeliver(const std::string& job_id, const std::string& id, std::int64_t now) override;
  void delete_before(std::int64_t then) override;

 private:
  queue::DiskHealth own_health_;
  std::unique_ptr<GroupCommit> commits_;
};

}  // namespace storage::sqlite
