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

/// As queue::Stores, with these differences: MaintenanceStore::recover has no effect, as leases end in time, and a
/// claim's `is_last` is never true, as other nodes claim too. A lost connection is replaced; a call that fails with it
/// runs again if it had no effect. When the answer to a commit was lost, the call requests its outcome for up to 10 s;
/// only a StoreFailure of kind `unknown` after that leaves it open.
///
/// The texts of jobs must be UTF-8 without the character 0, as PostgreSQL's.
class PostgresStores {
 public:
  /// `dsn`: a connection URI (postgres://user@host/database) or a key-value string of libpq. Creates the tables in an
  /// empty database. Throws StoreFailure.
  explicit PostgresStores(const std::string& dsn, const PostgresSettings& settings = {});
  ~PostgresStores();  ///< no call may be in progress
  PostgresStores(const PostgresStores&) = delete;
  PostgresStores& operator=(const PostgresStores&) = delete;

  [[nodiscard]] queue::Stores all() const;
  [[nodiscard]] queue::DeliveryStore& deliveries() const;
  [[nodiscard]] queue::ClusterStore& cluster() const;
  [[nodiscard]] queue::Wakeups& wakeups() const;
  /// The time of the database: nodes agree on it, whatever the clocks of their machines show. It is read again when a
  /// node is reported. Must not outlive this.
  [[nodiscard]] queue::Clock clock() const;
  [[nodiscard]] sql::Transactions& transactions() const;  ///< for other stores in the database
  [[nodiscard]] queue::TaskStore& tasks() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace storage::postgres
