#include "server/daemon/copy_data.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "server/daemon/shared_files.h"
#include "server/queue/clock.h"
#include "server/queue/job_store.h"
#include "server/storage/copy/copy_stores.h"
#include "server/storage/files/durable_file.h"
#include "server/storage/files/file_stores.h"
#include "server/storage/postgres/postgres_schema.h"
#include "server/storage/postgres/postgres_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace whittled {
namespace {

namespace fs = std::filesystem;

bool is_database(const std::string& to) { return to.starts_with("postgres://") || to.starts_with("postgresql://"); }

/// A data directory, which this locks.
struct Directory {
  explicit Directory(const std::string& path)
      : stores(path), files(path), artifacts(stores, files), assets(path + "/uploads", queue::system_clock()) {}
  storage::copy::End end() { return {stores.transactions(), stores.delivery_transactions(), artifacts, assets}; }

  storage::sqlite::SqliteStores stores;
  storage::files::FileArtifactStore files;
  storage::sqlite::SmallArtifactStore artifacts;
  storage::files::FileAssetStore assets;
};

struct Cluster {
  Cluster(const Config& config, const std::string& database, bool for_copy)
      : stores(database, {.connections = 10, .for_copy = for_copy}),
        files(config, stores.transactions(), stores.clock()) {}
  storage::copy::End end() { return {stores.transactions(), stores.transactions(), files.artifacts(), files.assets()}; }

  storage::postgres::PostgresStores stores;
  SharedFiles files;
};

void report(const std::string& line) { std::fprintf(stderr, "whittled: %s\n", line.c_str()); }

void copy_to_cluster(const Config& config, const std::string& database) {
  if (!fs::exists(config.data + "/whittle.db")) throw std::runtime_error(config.data + " has no data of a daemon");
  Directory from(config.data);
  {
    Cluster to(config, database, true);
    storage::copy::copy_all(from.end(), to.end(), &report);
  }
  storage::postgres::finish_copy(database);
}

void copy_to_directory(const Config& config, const std::string& directory) {
  if (fs::exists(directory)) throw std::runtime_error(directory + " exists already");
  const std::string part = directory + ".part";
  fs::create_directories(part);
  fs::permissions(part, fs::perms::owner_all);  // it contains the scenes of all owners
  {
    Cluster from(config, config.database, false);
    Directory to(part);
    storage::copy::copy_all(from.end(), to.end(), &report);
  }
  storage::files::sync_disk(part);
  fs::rename(part, directory);
  storage::files::sync_disk(directory);
}

}  // namespace

std::vector<ConfigError> find_copy_errors(const Config& config, const std::string& to) {
  std::vector<ConfigError> errors;
  if (to.empty()) errors.push_back({"--copy-to", "needs the URI of a database (postgres://...) or a new directory"});
  if (config.artifacts.empty())
    errors.push_back({"--copy-to", "needs --artifacts, the images and uploads that nodes share"});
  if (is_database(to) && !config.database.empty())
    errors.push_back({"--copy-to", "copies --data to a database; --database is that of a copy to a directory"});
  if (!is_database(to) && config.database.empty())
    errors.push_back({"--copy-to", "needs --database, the source of a copy to a directory"});
  if (const auto bucket = bucket_settings(config); !bucket) errors.push_back(bucket.error());
  return errors;
}

void copy_data(const Config& config, const std::string& to) {
  check_shared_files(config);
  if (is_database(to)) return copy_to_cluster(config, to);
  copy_to_directory(config, to);
}

}  // namespace whittled
