#include "server/storage/backup.h"

#include <filesystem>

#include "server/queue/job_store.h"
#include "server/storage/files/copy_files.h"
#include "server/storage/sqlite/copy_databases.h"

namespace storage {

void back_up(const std::string& data, const std::string& into) {
  namespace fs = std::filesystem;
  if (fs::exists(into)) throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, into + " exists already");
  const std::string part = into + ".part";
  fs::remove_all(part);  // of an interrupted backup
  fs::create_directories(part);
  fs::permissions(part, fs::perms::owner_all);  // it contains the scenes of all owners
  sqlite::copy_databases(data, part);
  files::copy_files(data, part);
  files::copy_files(data + "/uploads", part + "/uploads");
  files::sync_disk(part);
  fs::rename(part, into);
  files::sync_disk(into);
}

}  // namespace storage
