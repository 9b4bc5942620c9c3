#pragma once
/// The stores of jobs, tasks and webhook deliveries in PostgreSQL 15 or newer, which any number of nodes share.

#include <memory>
#include <string>

#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/queue/delivery_store.h"
#include "server/queue/job_store.h"
#include "server/queue/task_store.h"
#include "server/queue/wakeups.h"
#include "server/storage/sql/sql_database.h"

namespace storage::postgres {

struct PostgresSettings {
  std::string node{};   ///< unique name of this node, for the tasks that it claims
  std::string build{};  ///< its program (tracer::build): tasks are shared with nodes of the same one
  /// Transactions at once. A node has a few that write and a few that read; more only wait inside the server.
  int connections = 8;
  /// The stores get a copy of other data: the database must be empty, or have an unfinished copy. Until finish_copy (in
  /// postgres_schema.h) nothing else opens it.
  bool for_copy = false;
};

/// Throws StoreFailure if PostgresStores would because of the server or what the database contains. Changes nothing.
void check_database(const std::string& dsn);

/// queue::Stores with these differences: MaintenanceStore::recover has no effect, as leases end in time, and a
/// claim's `is_last` is never true, as other nodes claim too. A lost connection is replaced; a call that fails with it
/// runs again if it had no effect. When the answer to a commit was lost, the call requests its outcome for up to 10 s;
/// only a StoreFailure of kind `unknown` after that leaves it open.
///
/// The texts of jobs must be UTF-8 without the character 0, as PostgreSQL's.
class PostgresStores {
 public:
  /// `dsn`: a connection URI (postgres://user@host/database) or a key-value string of libpq. Creates the tables in an
  /// empty database. Throws StoreFailure. No call may be in progress at the destruction.
  explicit PostgresStores(const std::string& dsn, const PostgresSettings& settings = {});
  PostgresStores(PostgresStores&&) = delete;

  [[nodiscard]] queue::Stores all() const { return jobs_->all(); }
  [[nodiscard]] queue::DeliveryStore& deliveries() const { return *deliveries_; }
  [[nodiscard]] queue::ClusterStore& cluster() const { return *cluster_; }
  [[nodiscard]] queue::Wakeups& wakeups() const { return *wakeups_; }
  [[nodiscard]] queue::TaskStore& tasks() const { return *tasks_; }
  [[nodiscard]] sql::Transactions& transactions() const { return *transactions_; }  ///< for other stores
  /// See ClusterStore::now. Must not outlive this.
  [[nodiscard]] queue::Clock clock() const {
    return [&cluster = *cluster_] { return cluster.now(); };
  }

 private:
  const std::unique_ptr<sql::Transactions> transactions_;
  const std::unique_ptr<queue::JobStores> jobs_;
  const std::unique_ptr<queue::DeliveryStore> deliveries_;
  const std::unique_ptr<queue::TaskStore> tasks_;
  const std::unique_ptr<queue::ClusterStore> cluster_;
  const std::unique_ptr<queue::Wakeups> wakeups_;
};

}  // namespace storage::postgres
