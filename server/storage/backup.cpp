#include "server/storage/backup.h"

#include <filesystem>

#include "server/queue/job_store.h"
#include "server/storage/files/copy_files.h"
#include "server/storage/sqlite/copy_databases.h"

void back_up(const std::string& data, const std::string& into) {
  namespace fs = std::filesystem;
  if (fs::exists(into)) throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, into + " exists already");
  const std::string part = into + ".part";
  fs::remove_all(part);  // of a backup that was cut off
  fs::create_directories(part);
  fs::permissions(part, fs::perms::owner_all);  // others' scenes are in it
  queue::copy_databases(data, part);
  queue::copy_files(data, part);
  queue::copy_files(data + "/uploads", part + "/uploads");
  queue::sync_disk(part);
  fs::rename(part, into);
  queue::sync_disk(into);
}
