#pragma once
/// The connections of SqliteStores, which its stores share, and the stores themselves. Private to this directory.

#include <memory>
#include <string>

#include "server/queue/disk_health.h"
#include "server/storage/sqlite/directory_lock.h"
#include "server/storage/sqlite/group_commit.h"
#include "server/storage/sqlite/read_pool.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace storage::sqlite {

/// In the order of dependence: the lock is released last, the readers are closed before the writer, which checkpoints.
struct Connections {
  Connections(const std::string& directory, const SqliteSettings& settings);
  DirectoryLock lock;
  queue::DiskHealth own_health;
  GroupCommit writer;
  ReadPool reader;
};

/// The connections must outlive the stores.
std::unique_ptr<queue::JobStore> make_job_store(Connections& connections);
std::unique_ptr<queue::JobStatistics> make_job_statistics(Connections& connections);
std::unique_ptr<queue::JobTransitions> make_job_transitions(Connections& connections);
std::unique_ptr<queue::BatchStore> make_batch_store(Connections& connections);
std::unique_ptr<queue::MaintenanceStore> make_maintenance_store(Connections& connections);

}  // namespace storage::sqlite
