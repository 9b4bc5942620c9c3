#pragma once
/// The embedded stores of jobs: one SQLite file, DIRECTORY/whittle.db, in a directory that one process owns.

#include <memory>
#include <string>

#include "server/queue/disk_health.h"
#include "server/queue/job_store.h"

namespace storage::sqlite {

struct SqliteSettings {
  int read_connections = 4;  ///< reads that run at once; a read takes well under a millisecond, a text search up to 50
  queue::DiskHealth* health = nullptr;  ///< health of the disk; null: private to the stores. Must outlive them
  bool synchronous = true;              ///< false, in tests: nothing survives power loss
};

struct Connections;

/// WAL with synchronous = FULL: a durable call survives power loss. Writes share syncs (group commit), so more callers
/// at once mean more writes a second. A copy of the directory of a running daemon is not a backup.
class SqliteStores {
 public:
  /// Creates `directory` and the file where missing and locks the directory for its lifetime. Throws StoreFailure with
  /// the reason: the directory is in use by another process, the file has another schema, no permission, disk full, ...
  explicit SqliteStores(const std::string& directory, SqliteSettings settings = {});
  ~SqliteStores();  ///< no call may be in progress
  SqliteStores(const SqliteStores&) = delete;
  SqliteStores& operator=(const SqliteStores&) = delete;

  [[nodiscard]] queue::Stores all() const { return {*jobs_, *statistics_, *transitions_, *batches_, *maintenance_}; }
  [[nodiscard]] Connections& connections() const { return *connections_; }  ///< for the other stores of the file

 private:
  std::unique_ptr<Connections> connections_;
  std::unique_ptr<queue::JobStore> jobs_;
  std::unique_ptr<queue::JobStatistics> statistics_;
  std::unique_ptr<queue::JobTransitions> transitions_;
  std::unique_ptr<queue::BatchStore> batches_;
  std::unique_ptr<queue::MaintenanceStore> maintenance_;
};

}  // namespace storage::sqlite
