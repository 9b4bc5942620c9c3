#include "server/daemon/job_database.h"

#include <utility>

#include "server/queue/clock.h"
#include "server/storage/files/directory_lock.h"
#include "server/storage/files/file_stores.h"
#include "server/storage/postgres/postgres_stores.h"
#include "server/storage/sqlite/sqlite_delivery_store.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tracer/version.h"

namespace whittled {
namespace {

/// Images and uploads in the data directory.
struct LocalFiles {
  LocalFiles(const Config& config, queue::DiskHealth& health, queue::Clock clock)
      : artifacts(config.data, &health),
        assets(uploads_directory(config), std::move(clock), config.uploads_bytes, &health) {}

  /// Reads one image, slowly enough not to disturb others, and returns the pause before the next one.
  std::chrono::milliseconds scrub_next(const queue::Log& log) {
    constexpr std::uint64_t bytes_per_ms = 10'000;
    const auto scrubbed = artifacts.scrub();
    if (!scrubbed) return std::chrono::hours(24);
    if (scrubbed->damaged) log(queue::LogLevel::error, "artifact_damaged", {{"sha256", scrubbed->artifact.sha256}});
    return std::chrono::milliseconds(20 + scrubbed->artifact.bytes / bytes_per_ms);
  }

  storage::files::FileArtifactStore artifacts;
  storage::files::FileAssetStore assets;
};

/// One file in the data directory.
class EmbeddedDatabase final : public JobDatabase {
 public:
  EmbeddedDatabase(const Config& config, queue::DiskHealth& health)
      : sqlite_(config.data, {.health = &health}),
        files_(config, health, queue::system_clock()),
        artifacts_(sqlite_, files_.artifacts),
        deliveries_(storage::sqlite::open_delivery_store(config.data, &health)) {}
  queue::Stores stores() override { return sqlite_.all(); }
  queue::DeliveryStore& deliveries() override { return *deliveries_; }
  queue::ArtifactStore& artifacts() override { return artifacts_; }
  queue::Clock clock() override { return queue::system_clock(); }
  std::optional<Sharing> sharing() override { return std::nullopt; }
  queue::AssetStore& assets() override { return files_.assets; }
  std::chrono::milliseconds maintain_artifacts(const queue::Log& log) override { return files_.scrub_next(log); }

 private:
  storage::sqlite::SqliteStores sqlite_;
  LocalFiles files_;
  storage::sqlite::SmallArtifactStore artifacts_;
  const std::unique_ptr<queue::DeliveryStore> deliveries_;
};

/// A server.
class DatabaseServer : public JobDatabase {
 public:
  DatabaseServer(const Config& config, const std::string& node)
      : lock_(config.data), postgres_(config.database, {.node = node, .build = std::string(tracer::build())}) {}
  queue::Stores stores() override { return postgres_.all(); }
  queue::DeliveryStore& deliveries() override { return postgres_.deliveries(); }
  queue::Clock clock() final { return postgres_.clock(); }
  std::optional<Sharing> sharing() override {
    return Sharing{postgres_.cluster(), postgres_.wakeups(), postgres_.tasks()};
  }

 protected:
  storage::sql::Transactions& transactions() { return postgres_.transactions(); }

 private:
  const storage::files::DirectoryLock lock_;
  storage::postgres::PostgresStores postgres_;
};

class ServerWithLocalFiles final : public DatabaseServer {
 public:
  ServerWithLocalFiles(const Config& config, const std::string& node, queue::DiskHealth& health)
      : DatabaseServer(config, node), files_(config, health, clock()) {}
  queue::ArtifactStore& artifacts() override { return files_.artifacts; }
  queue::AssetStore& assets() override { return files_.assets; }
  std::chrono::milliseconds maintain_artifacts(const queue::Log& log) override { return files_.scrub_next(log); }

 private:
  LocalFiles files_;
};

class ServerWithSharedFiles final : public DatabaseServer {
 public:
  ServerWithSharedFiles(const Config& config, const std::string& node)
      : DatabaseServer(config, node),
        files_(config, transactions(), clock()),
        cache_(uploads_directory(config), config.asset_cache_bytes, files_.assets()) {}
  queue::ArtifactStore& artifacts() override { return files_.artifacts(); }
  queue::AssetStore& assets() override { return files_.assets(); }
  std::chrono::milliseconds maintain_artifacts(const queue::Log& log) override { return files_.collect(log); }
  SharedFiles* shared_files() override { return &files_; }
  storage::objects::AssetCache* asset_cache() override { return &cache_; }

 private:
  SharedFiles files_;
  storage::objects::AssetCache cache_;
};

}  // namespace

std::string uploads_directory(const Config& config) {
  return config.data + (config.artifacts.empty() ? "/uploads" : "/asset-cache");
}

std::unique_ptr<JobDatabase> open_database(const Config& config, const std::string& node, queue::DiskHealth& health) {
  if (config.database.empty()) return std::make_unique<EmbeddedDatabase>(config, health);
  if (config.artifacts.empty()) return std::make_unique<ServerWithLocalFiles>(config, node, health);
  return std::make_unique<ServerWithSharedFiles>(config, node);
}

void check_database(const Config& config) {
  if (!config.database.empty()) return storage::postgres::check_database(config.database);
  storage::sqlite::check_jobs_file(config.data);
  storage::sqlite::check_deliveries_file(config.data);
}

}  // namespace whittled
