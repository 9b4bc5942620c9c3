#pragma once
/// What a SqliteJobStore is made of. Private to this directory.

#include <memory>
#include <string>

#include "server/storage/sqlite/database.h"
#include "server/storage/sqlite/directory_lock.h"
#include "server/storage/sqlite/group_commit.h"
#include "server/storage/sqlite/read_pool.h"
#include "server/storage/sqlite/schema.h"
#include "server/storage/sqlite/sqlite_job_store.h"

namespace queue {

namespace sqlite {

inline std::unique_ptr<Database> open_writer(const std::string& path) {
  auto database = std::make_unique<Database>(path, Database::Access::read_write);
  prepare_file(*database, path);
  return database;
}

}  // namespace sqlite

/// In the order of dependence: the lock goes last, the readers before the writer, which checkpoints as it closes.
struct SqliteJobStore::Connections {
  Connections(const std::string& directory, const std::string& path, const SqliteSettings& settings)
      : lock(directory),
        writer(sqlite::open_writer(path), settings.health == nullptr ? own_health : *settings.health),
        reader(path, settings.read_connections),
        image_reader(path, 1) {}
  sqlite::DirectoryLock lock;
  DiskHealth own_health;
  sqlite::GroupCommit writer;
  sqlite::ReadPool reader;
  /// Of small images alone, some microseconds each: who streams them waits for no text search.
  sqlite::ReadPool image_reader;
};

}  // namespace queue
