#pragma once
/// The stores of jobs and of webhook deliveries over an SQL database, whose tables must exist: see the schemas of
/// server/storage/sqlite and server/storage/postgres.

#include <memory>

#include "server/queue/delivery_store.h"
#include "server/queue/job_store.h"
#include "server/storage/sql/sql_database.h"

namespace storage::sql {

/// One of each interface of queue::Stores. `transactions` must outlive it.
class JobStores {
 public:
  explicit JobStores(Transactions& transactions);
  [[nodiscard]] queue::Stores all() const { return {*jobs_, *statistics_, *transitions_, *batches_, *maintenance_}; }

 private:
  std::unique_ptr<queue::JobStore> jobs_;
  std::unique_ptr<queue::JobStatistics> statistics_;
  std::unique_ptr<queue::JobTransitions> transitions_;
  std::unique_ptr<queue::BatchStore> batches_;
  std::unique_ptr<queue::MaintenanceStore> maintenance_;
};

std::unique_ptr<queue::JobStore> make_job_store(Transactions& transactions);
std::unique_ptr<queue::JobStatistics> make_job_statistics(Transactions& transactions);
std::unique_ptr<queue::JobTransitions> make_job_transitions(Transactions& transactions);
std::unique_ptr<queue::BatchStore> make_batch_store(Transactions& transactions);
std::unique_ptr<queue::MaintenanceStore> make_maintenance_store(Transactions& transactions);
std::unique_ptr<queue::DeliveryStore> make_delivery_store(std::shared_ptr<Transactions> transactions);

}  // namespace storage::sql
