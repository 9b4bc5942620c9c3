#include "server/storage/backup.h"

#include <filesystem>

#include "server/queue/asset_store.h"
#include "server/storage/files/durable_file.h"
#include "server/storage/sqlite/database.h"

namespace storage {
namespace {

using namespace files;

/// The database as of one moment. A reader neither writes its log nor checkpoints it.
void copy_database(const std::string& from, const std::string& to) {
  std::filesystem::remove(to);  // of a moment before
  sqlite::SqliteDatabase(from, sqlite::SqliteDatabase::Access::read_only).change("VACUUM INTO ?", to);
}

void copy_file(const std::string& directory, const NamedFile& file, const std::string& into) {
  const auto source = open_reader(directory, file.sha256);
  if (!source) return;
  TemporaryFile copy(into);
  const auto stored = copy.copy(contents_of(*source));
  if (stored.sha256 != file.sha256) {
    throw queue::StoreFailure(path_of(directory, file.sha256) + " is damaged: its bytes have the sha256 " +
                              stored.sha256);
  }
  copy.set_time(file.modified_ms());
  copy.rename_to(path_of(into, file.sha256));
}

/// Copies every file DIRECTORY/ab/abcdef... to the same path below `into`, with the time of its last change, except
/// those removed meanwhile.
void copy_files(const std::string& directory, const std::string& into) {
  create_directories(into);
  for (int part = 0; part < queue::AssetStore::parts; ++part) {
    if (!std::filesystem::is_directory(directory + "/" + name_of_part(part))) continue;
    for (const NamedFile& file : files_of_part(directory, part)) copy_file(directory, file, into);
  }
}

void copy_all(const std::string& data, const std::string& into) {
  // In this order: a subscription is stored before its job, so each copied job has its subscriptions.
  copy_database(data + "/whittle.db", into + "/whittle.db");
  if (std::filesystem::exists(data + "/webhooks.db")) copy_database(data + "/webhooks.db", into + "/webhooks.db");
  copy_files(data, into);
  copy_files(data + "/uploads", into + "/uploads");
}

/// The first image or upload that the database of a copy names and the copy does not have; empty if there is none.
std::string missing_file(const std::string& copy) {
  sqlite::SqliteDatabase database(copy + "/whittle.db", sqlite::SqliteDatabase::Access::read_only);
  const auto is_missing = [](const std::string& directory, const std::string& sha256) {
    return !std::filesystem::exists(path_of(directory, sha256));
  };
  sql::Query image = database.query(
      "SELECT sha256, job_id, name FROM artifacts WHERE sha256 NOT IN (SELECT sha256 FROM small_artifacts)");
  while (image.row())
    if (is_missing(copy, image.text(0)))
      return image.text(2) + " of job " + image.text(1) + " (sha256 " + image.text(0) + ")";
  sql::Query upload = database.query("SELECT sha256 FROM job_assets UNION SELECT sha256 FROM scene_assets");
  while (upload.row())
    if (is_missing(copy + "/uploads", upload.text(0))) return "the upload " + upload.text(0);
  return {};
}

}  // namespace

void back_up(const std::string& data, const std::string& into) {
  namespace fs = std::filesystem;
  if (fs::exists(into)) throw queue::StoreFailure(into + " exists already");
  const std::string part = into + ".part";
  fs::remove_all(part);  // of an interrupted backup
  fs::create_directories(part);
  fs::permissions(part, fs::perms::owner_all);  // it contains the scenes of all owners
  // Jobs may be deleted between the copy of the database and that of the files: a later copy does not name theirs.
  constexpr int tries = 3;
  std::string missing = "not copied yet";
  for (int i = 0; i < tries && !missing.empty(); ++i) {
    copy_all(data, part);
    missing = missing_file(part);
  }
  if (!missing.empty()) throw queue::StoreFailure(missing + " is missing; delete the job");
  sync_disk(part);
  fs::rename(part, into);
  sync_disk(into);
}

}  // namespace storage
