#include "server/daemon/job_database.h"

#include "server/storage/files/directory_lock.h"
#include "server/storage/postgres/postgres_stores.h"
#include "server/storage/sqlite/sqlite_delivery_store.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace whittled {
namespace {

/// One file in the data directory.
class EmbeddedDatabase final : public JobDatabase {
 public:
  EmbeddedDatabase(const std::string& data, queue::DiskHealth& health)
      : sqlite_(data, {.health = &health}),
        files_(data, &health),
        artifacts_(sqlite_, files_),
        deliveries_(storage::sqlite::open_delivery_store(data, &health)) {}
  queue::Stores stores() override { return sqlite_.all(); }
  queue::DeliveryStore& deliveries() override { return *deliveries_; }
  queue::ArtifactStore& artifacts() override { return artifacts_; }
  storage::files::FileArtifactStore& files() override { return files_; }
  queue::Clock clock() override { return queue::system_clock(); }
  std::optional<Sharing> sharing() override { return std::nullopt; }

 private:
  storage::sqlite::SqliteStores sqlite_;
  storage::files::FileArtifactStore files_;
  storage::sqlite::SmallArtifactStore artifacts_;
  const std::unique_ptr<queue::DeliveryStore> deliveries_;
};

/// A server; the images are files of the data directory.
class DatabaseServer final : public JobDatabase {
 public:
  DatabaseServer(const Config& config, queue::DiskHealth& health)
      : lock_(config.data), postgres_(config.database), files_(config.data, &health) {}
  queue::Stores stores() override { return postgres_.all(); }
  queue::DeliveryStore& deliveries() override { return postgres_.deliveries(); }
  queue::ArtifactStore& artifacts() override { return files_; }
  storage::files::FileArtifactStore& files() override { return files_; }
  queue::Clock clock() override { return postgres_.clock(); }
  std::optional<Sharing> sharing() override { return Sharing{postgres_.cluster(), postgres_.wakeups()}; }

 private:
  const storage::files::DirectoryLock lock_;
  storage::postgres::PostgresStores postgres_;
  storage::files::FileArtifactStore files_;
};

}  // namespace

std::unique_ptr<JobDatabase> open_database(const Config& config, queue::DiskHealth& health) {
  if (config.database.empty()) return std::make_unique<EmbeddedDatabase>(config.data, health);
  return std::make_unique<DatabaseServer>(config, health);
}

void check_database(const Config& config) {
  if (!config.database.empty()) return storage::postgres::check_database(config.database);
  storage::sqlite::check_jobs_file(config.data);
  storage::sqlite::check_deliveries_file(config.data);
}

}  // namespace whittled
