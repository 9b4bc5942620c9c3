#pragma once
/// The embedded store of webhook deliveries: one SQLite file of its own, DIRECTORY/webhooks.db, so that deliveries
/// never delay the commits of jobs.

#include <memory>
#include <string>

#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"
#include "server/storage/sql/sql_database.h"

namespace storage::sqlite {

/// See check_jobs_file.
void check_deliveries_file(const std::string& directory);

/// WAL with synchronous = FULL over a single connection; calls that wait at once share a commit. Creates the file where
/// missing. Precondition: this process holds the directory's lock (SqliteStores). Throws StoreFailure, also for a file
/// with another schema. `health` is that of the disk; null: private to this store.
std::unique_ptr<queue::DeliveryStore> open_delivery_store(const std::string& directory,
                                                          queue::DiskHealth* health = nullptr);

/// The same file, for other uses of its tables.
std::unique_ptr<sql::Transactions> open_deliveries(const std::string& directory, queue::DiskHealth* health = nullptr);

}  // namespace storage::sqlite
