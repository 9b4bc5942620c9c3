#pragma once
/// One SQLite connection and its statements, as values that release their resources. Private to server/storage.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/storage/sql/sql_database.h"

struct sqlite3;

namespace storage::sqlite {

/// Used by one thread at a time.
class SqliteDatabase final : public sql::Database {
 public:
  enum class Access { read_write, read_only };
  /// Not `synchronous`: commits never wait for the disk.
  SqliteDatabase(const std::string& path, Access access, bool synchronous = true);
  ~SqliteDatabase() override;

  void script(const std::string& sql);  ///< several statements, unprepared

  /// From now on commits also checkpoint the log: as far as readers allow once it has `pages_target` pages, and waiting
  /// for readers once it has `pages_max`, so that steady reading cannot make it grow without bound.
  void checkpoint_at(int pages_target, int pages_max);

  /// With `wait`, commits wait for the disk from now on (synchronous = FULL, else NORMAL). Not within a transaction.
  void sync_commits(bool wait);

  /// Closing does not checkpoint the log.
  void keep_log();

  [[nodiscard]] bool in_transaction() const;

 private:
  sql::Statement& prepared(const std::string& sql) override;

  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
  std::map<std::string, std::unique_ptr<sql::Statement>> statements_;
  const bool synchronous_;
  std::optional<bool> commits_wait_;
  int checkpoint_pages_target_ = 0, checkpoint_pages_max_ = 0;
};

bool is_new(SqliteDatabase& database);  ///< nothing was created in it
/// False if there is no database yet. Throws StoreFailure if there is a file with another version, or one that cannot
/// be read. Changes nothing.
bool check_file(const std::string& path, std::int64_t version);

/// Sets up the connection (WAL, synchronous = FULL) and creates the tables of `schema` in an empty file. Throws
/// StoreFailure, with the file unchanged, for that of another program or version.
void prepare(SqliteDatabase& database, const std::string& path, std::int64_t version, const std::string& schema);

}  // namespace storage::sqlite
