#pragma once
/// The stores that the options name: jobs and webhook deliveries in SQLite or PostgreSQL, images and uploads in the
/// data directory or where all nodes have them.

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/daemon/config.h"
#include "server/daemon/shared_files.h"
#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"
#include "server/storage/files/directory_lock.h"
#include "server/storage/files/disk_space_monitor.h"
#include "server/storage/files/file_stores.h"
#include "server/storage/objects/asset_cache.h"
#include "server/storage/postgres/postgres_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace whittled {

struct Storage {
  /// Locks the data directory. `on_disk_failure` is called once, at the first I/O error. Throws with the reason if the
  /// directory, or the one of assets, cannot be used.
  Storage(const Config& config, const queue::Log& log, std::function<void(const std::string&)> on_disk_failure);

  /// One small step of the search for damaged images, or of the removal of those that no job names; returns the pause
  /// before the next one. One thread.
  std::chrono::milliseconds maintain_artifacts(const queue::Log& log);

  const std::string spool_directory;
  storage::files::DiskSpaceMonitor disk;
  queue::DiskHealth disk_health;
  // Either of these two: a file that one daemon uses at a time, or a server.
  const std::unique_ptr<storage::sqlite::SqliteStores> sqlite;
  const std::unique_ptr<storage::files::DirectoryLock> lock;  ///< null: SQLite locks the directory
  const std::unique_ptr<storage::postgres::PostgresStores> postgres;
  const queue::Clock clock;  ///< the time of the rows
  const queue::Stores stores;
  queue::DeliveryStore& deliveries;
  // Either of the next two or three.
  const std::unique_ptr<storage::files::FileArtifactStore> artifact_files;
  const std::unique_ptr<storage::files::FileAssetStore> upload_files;
  const std::unique_ptr<storage::sqlite::SmallArtifactStore> small_artifacts;  ///< null: all of them are files
  const std::unique_ptr<SharedFiles> shared_files;
  const std::unique_ptr<storage::objects::AssetCache> asset_cache;  ///< copies of the shared uploads
  queue::ArtifactStore& artifacts;
  queue::AssetStore& uploads;
};

/// Directory of the uploads, or of their copies on this node.
std::string uploads_directory(const Config& config);

/// Throws StoreFailure if the database cannot be opened. Changes nothing.
void check_database(const Config& config);

}  // namespace whittled
