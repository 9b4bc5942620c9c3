#pragma once
/// The embedded DeliveryStore: one SQLite file of its own, FOLDER/webhooks.db, so that a slow receiver's log never
/// holds up the queue's commits.

#include <memory>
#include <mutex>
#include <string>

#include "server/jobs/delivery_store.h"

namespace jobs {

namespace sqlite {
class Database;
}

/// WAL with synchronous = FULL over a single connection, a call at a time: an end of a job costs it two commits.
class SqliteDeliveryStore final : public DeliveryStore {
 public:
  /// Creates the file where missing. The folder is one process's (SqliteJobStore's lock). Throws StoreFailure, also for
  /// a file that a newer program wrote.
  explicit SqliteDeliveryStore(const std::string& folder);
  ~SqliteDeliveryStore() override;

  void subscribe(const Subscription& subscription) override;
  std::optional<Subscription> subscription(const std::string& job_id) override;
  std::vector<std::string> subscribed_jobs() override;
  void unsubscribe(const std::string& job_id) override;
  void owe(const Delivery& delivery) override;
  std::optional<Delivery> next() override;
  void attempted(const std::string& id, const DeliveryAttempt& attempt, DeliveryState state,
                 std::optional<std::int64_t> next_attempt_at) override;
  std::vector<Delivery> of_job(const std::string& job_id) override;
  void forget_before(std::int64_t then) override;

 private:
  std::mutex mutex_;
  std::unique_ptr<sqlite::Database> database_;
};

}  // namespace jobs
