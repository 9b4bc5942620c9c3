#pragma once
/// The embedded stores: jobs and small artifacts in one SQLite file, DIRECTORY/whittle.db, and webhook deliveries in
/// another, DIRECTORY/webhooks.db, so that they never delay the commits of jobs. One process owns the directory.

#include <memory>
#include <optional>
#include <string>

#include "server/queue/artifact_store.h"
#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"
#include "server/queue/job_store.h"

namespace storage::sqlite {

struct SqliteSettings {
  int read_connections = 4;  ///< reads that run at once; a read takes well under a millisecond, a text search up to 50
  queue::DiskHealth* health = nullptr;  ///< health of the disk; null: private to the stores. Must outlive them
  bool synchronous = true;              ///< false, in tests: nothing survives power loss
};

struct Connections;

/// Throws StoreFailure if SqliteStores would because of the content of the files. Changes nothing.
void check_files(const std::string& directory);

/// WAL with synchronous = FULL: a durable call survives power loss. Writes share syncs (group commit), so more callers
/// at once mean more writes a second. A copy of the directory of a running daemon is not a backup.
class SqliteStores {
 public:
  /// Creates `directory` and the files where missing and locks the directory for its lifetime. Throws StoreFailure with
  /// the reason: the directory is in use by another process, a file has another schema, no permission, disk full, ...
  explicit SqliteStores(const std::string& directory, SqliteSettings settings = {});
  ~SqliteStores();  ///< no call may be in progress
  SqliteStores(SqliteStores&&) = delete;

  [[nodiscard]] queue::Stores all() const { return stores_->all(); }
  [[nodiscard]] queue::DeliveryStore& deliveries() const { return *deliveries_; }
  // For other stores of the files.
  [[nodiscard]] sql::Transactions& transactions() const;
  [[nodiscard]] sql::Transactions& delivery_transactions() const;

 private:
  std::unique_ptr<Connections> connections_;
  std::unique_ptr<queue::JobStores> stores_;
  std::unique_ptr<queue::DeliveryStore> deliveries_;
};

/// Artifacts of up to 32 KiB as rows of the SQLite file, all others in a second store. A small image as a file takes
/// two syncs before the one of its job's row; as a row it takes none of its own. That halves the time of a small job.
///
/// A row is synced by the next durable write of a job to the same SqliteStores, as the commits of a file are durable in
/// their order. So the row is durable before the row of the job that names it.
class SmallArtifactStore final : public queue::ArtifactStore {
 public:
  /// Both stores must outlive it.
  SmallArtifactStore(const SqliteStores& stores, queue::ArtifactStore& large)
      : rows_(stores.transactions()), large_(large) {}

  Stored put(int fd, bool durable = true) override;
  void sync(const std::string& sha256) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256, bool verified = true) override;
  void remove(const std::string& sha256) override;

 private:
  std::optional<std::string> find(const std::string& sha256);

  sql::Transactions& rows_;
  queue::ArtifactStore& large_;
};

}  // namespace storage::sqlite
