#include "server/storage/sqlite/sqlite_delivery_store.h"

#include <utility>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/schema.h"

namespace storage::sqlite {
namespace {

std::string deliveries_file(const std::string& directory) { return directory + "/webhooks.db"; }

std::unique_ptr<SqliteDatabase> open(const std::string& path) {
  auto database = std::make_unique<SqliteDatabase>(path, SqliteDatabase::Access::read_write);
  prepare(*database, path, deliveries_schema_version, deliveries_schema());
  return database;
}

class OneConnection final : public sql::Transactions {
 public:
  OneConnection(std::unique_ptr<SqliteDatabase> database, queue::DiskHealth* health)
      : commits_(std::move(database), health == nullptr ? own_health_ : *health) {}

 private:
  void run_write(const Run& work, sql::Synced synced) override { commits_.run(work, synced); }
  void run_read(const Run& work) override { commits_.run(work, sql::Synced::with_next); }

  queue::DiskHealth own_health_;
  GroupCommit commits_;
};

}  // namespace

void check_deliveries_file(const std::string& directory) {
  (void)check_file(deliveries_file(directory), deliveries_schema_version);
}

std::unique_ptr<queue::DeliveryStore> open_delivery_store(const std::string& directory, queue::DiskHealth* health) {
  return std::make_unique<queue::DeliveryStore>(open_deliveries(directory, health));
}

std::unique_ptr<sql::Transactions> open_deliveries(const std::string& directory, queue::DiskHealth* health) {
  return std::make_unique<OneConnection>(open(deliveries_file(directory)), health);
}

}  // namespace storage::sqlite
