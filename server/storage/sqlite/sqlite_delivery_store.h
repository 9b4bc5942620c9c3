#pragma once
/// The embedded DeliveryStore: one SQLite file of its own, DIRECTORY/webhooks.db, so that a slow receiver's log never
/// holds up the queue's commits.

#include <memory>
#include <set>
#include <string>

#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"

namespace queue {

namespace sqlite {
class GroupCommit;
}

/// WAL with synchronous = FULL over a single connection; calls that wait at once share a commit.
class SqliteDeliveryStore final : public DeliveryStore {
 public:
  /// Creates the file where missing, brings an older one up to date. The directory is one process's (SqliteJobStore's
  /// lock). Throws StoreFailure, also for a file that a newer program wrote. `health` is that of the disk; null: nobody
  /// else is to know.
  explicit SqliteDeliveryStore(const std::string& directory, DiskHealth* health = nullptr);
  ~SqliteDeliveryStore() override;

  void subscribe(const Subscription& subscription) override;
  std::optional<Subscription> subscription(const std::string& job_id) override;
  std::vector<std::string> subscribed_jobs() override;
  void unsubscribe(const std::string& job_id) override;
  void enqueue(const Delivery& delivery) override;
  std::optional<Delivery> next(const std::set<std::string>& busy) override;
  void record_attempt(const std::string& id, const DeliveryAttempt& attempt, DeliveryState state,
                      std::optional<std::int64_t> next_attempt_at) override;
  std::vector<Delivery> of_job(const std::string& job_id) override;
  void delete_before(std::int64_t then) override;

 private:
  DiskHealth own_health_;
  std::unique_ptr<sqlite::GroupCommit> commits_;
};

}  // namespace queue
