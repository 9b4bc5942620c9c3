#pragma once
/// The state that nodes share beside the jobs, in PostgreSQL. Private to this directory.

#include <atomic>
#include <cstdint>
#include <memory>

#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/storage/sql/sql_database.h"

namespace storage::postgres {

/// The database's clock: read now and then, continued by the steady clock of this machine. Thread-safe.
class DatabaseClock {
 public:
  explicit DatabaseClock(sql::Transactions& transactions) : transactions_(transactions) { synchronize(); }
  /// Throws StoreFailure; the clock then continues as before.
  void synchronize();
  [[nodiscard]] std::int64_t now() const;

 private:
  sql::Transactions& transactions_;
  std::atomic<std::int64_t> ahead_us_{0};  ///< compared with the steady clock
};

/// `clock` is synchronized when a node is reported. Both must outlive the result.
std::unique_ptr<queue::ClusterStore> make_cluster_store(sql::Transactions& transactions, DatabaseClock& clock);

}  // namespace storage::postgres
