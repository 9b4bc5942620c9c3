#include "server/storage/sqlite/copy_databases.h"

#include <filesystem>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {
namespace {

/// A reader: it neither writes the log nor checkpoints it.
void copy(const std::string& from, const std::string& to) {
  Database(from, Database::Access::read_only).change("VACUUM INTO ?", to);
}

}  // namespace

void copy_databases(const std::string& directory, const std::string& into) {
  copy(directory + "/whittle.db", into + "/whittle.db");
  const std::string deliveries = "/webhooks.db";
  if (std::filesystem::exists(directory + deliveries)) copy(directory + deliveries, into + deliveries);
}

}  // namespace storage::sqlite
