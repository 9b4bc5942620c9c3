#include "server/storage/sqlite/copy_databases.h"

#include <filesystem>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace queue {
namespace {

/// A reader among others: it neither writes the log nor brings it into the file.
void copy(const std::string& from, const std::string& to) {
  sqlite::Database(from, sqlite::Database::Access::read_only).change("VACUUM INTO ?", to);
}

}  // namespace

void copy_databases(const std::string& directory, const std::string& into) {
  copy(directory + "/whittle.db", into + "/whittle.db");
  const std::string deliveries = "/webhooks.db";
  if (std::filesystem::exists(directory + deliveries)) copy(directory + deliveries, into + deliveries);
}

}  // namespace queue
