#pragma once
/// One SQLite connection and its statements, as values that release their resources. Private to server/storage.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace storage::sqlite {

/// Bytes bound as a BLOB without a copy: they must outlive the query.
struct Blob {
  std::string_view bytes;
};

/// A running statement: step with `row`, then read columns. The destructor resets the statement. Every failure is a
/// StoreFailure; a violated constraint is a bug of the caller and a std::logic_error.
class Query {
 public:
  /// Binds `values` to the statement's parameters, in order.
  template <class... Values>
  Query(sqlite3* connection, sqlite3_stmt* statement, const Values&... values)
      : connection_(connection), statement_(statement) {
    [[maybe_unused]] int position = 0;
    (bind(++position, values), ...);
  }
  ~Query();
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  bool row();                        ///< false at the end
  std::vector<std::string> texts();  ///< the first column of all remaining rows

  void bind(int position, std::int64_t value);
  void bind(int position, const std::string& value);
  void bind(int position, Blob value);
  template <class T>
  void bind(int position, const std::optional<T>& value) {
    if (value) bind(position, *value);  // else NULL, as after reset
  }

  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::optional<std::int64_t> optional_integer(int column) const;
  [[nodiscard]] std::string text(int column) const;  ///< also of a BLOB: the bytes as they are

 private:
  sqlite3* connection_;
  sqlite3_stmt* statement_;
};

/// Used by one thread at a time.
class Database {
 public:
  enum class Access { read_write, read_only };
  /// Not `synchronous`: commits never wait for the disk.
  Database(const std::string& path, Access access, bool synchronous = true);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Each text is prepared once and kept, so the texts must be few. Two queries of the same text must not overlap.
  template <class... Values>
  Query query(const std::string& sql, const Values&... values) {
    return Query(connection_.get(), prepared(sql), values...);
  }
  /// Runs a statement without result rows; returns the number of changed rows.
  template <class... Values>
  int change(const std::string& sql, const Values&... values) {
    query(sql, values...).row();
    return changes();
  }
  void script(const std::string& sql);  ///< several statements, unprepared

  /// From now on commits also checkpoint the log: as far as readers allow once it has `pages_wanted` pages, and waiting
  /// for readers once it has `pages_max`, so that steady reading cannot make it grow without bound.
  void checkpoint_at(int pages_wanted, int pages_max);

  /// With `wait`, commits wait for the disk from now on (synchronous = FULL, else NORMAL). Not within a transaction.
  void sync_commits(bool wait);

  /// Closing does not checkpoint the log.
  void keep_log();

  [[nodiscard]] bool in_transaction() const;

 private:
  sqlite3_stmt* prepared(const std::string& sql);
  [[nodiscard]] int changes() const;

  struct Close {
    void operator()(sqlite3* connection) const;
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
  std::map<std::string, std::unique_ptr<sqlite3_stmt, Finalize>> statements_;
  const bool synchronous_;
  std::optional<bool> commits_wait_;
  int checkpoint_pages_wanted_ = 0, checkpoint_pages_max_ = 0;
};

bool is_new(Database& database);  ///< nothing was created in it
/// False if there is no database yet. Throws StoreFailure if there is a file with another version, or one that cannot
/// be read. Changes nothing.
bool check_file(const std::string& path, std::int64_t version);

/// Sets up the connection (WAL, synchronous = FULL) and creates the tables of `schema` in an empty file. Throws
/// StoreFailure, with the file unchanged, for that of another program or version.
void prepare(Database& database, const std::string& path, std::int64_t version, const std::string& schema);

}  // namespace storage::sqlite
