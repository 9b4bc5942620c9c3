#pragma once
/// The stores of jobs over an SQL database, whose tables must exist: see the schemas of server/storage/sqlite and
/// server/storage/postgres.

#include <memory>

#include "server/queue/job_store.h"

namespace queue {

/// One of each interface of queue::Stores. `transactions` must outlive it.
class JobStores {
 public:
  explicit JobStores(sql::Transactions& transactions);
  [[nodiscard]] Stores all() { return {*jobs_, statistics_, transitions_, batches_, maintenance_}; }

 private:
  std::unique_ptr<JobStore> jobs_;
  JobStatistics statistics_;
  JobTransitions transitions_;
  BatchStore batches_;
  MaintenanceStore maintenance_;
};

std::unique_ptr<JobStore> make_job_store(sql::Transactions& transactions);

}  // namespace queue
