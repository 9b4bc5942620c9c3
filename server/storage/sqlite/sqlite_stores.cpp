#include "server/storage/sqlite/sqlite_stores.h"

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/schema.h"

namespace storage::sqlite {
namespace {

std::string file_of(const std::string& directory) { return directory + "/whittle.db"; }

std::unique_ptr<Database> open_writer(const std::string& path, bool synchronous) {
  auto database = std::make_unique<Database>(path, Database::Access::read_write, synchronous);
  prepare_jobs(*database, path);
  return database;
}

}  // namespace

Connections::Connections(const std::string& directory, const SqliteSettings& settings)
    : lock(directory),
      writer(open_writer(file_of(directory), settings.synchronous),
             settings.health == nullptr ? own_health : *settings.health),
      reader(file_of(directory), settings.read_connections) {}

SqliteStores::SqliteStores(const std::string& directory, SqliteSettings settings)
    : connections_(std::make_unique<Connections>(directory, settings)),
      jobs_(make_job_store(*connections_)),
      statistics_(make_job_statistics(*connections_)),
      transitions_(make_job_transitions(*connections_)),
      batches_(make_batch_store(*connections_)),
      maintenance_(make_maintenance_store(*connections_)) {}
SqliteStores::~SqliteStores() = default;

}  // namespace storage::sqlite
