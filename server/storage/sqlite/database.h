#pragma once
/// One SQLite connection and its statements, as values that clean up after themselves. Private to this directory.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace queue::sqlite {

/// Bytes bound as a BLOB without a copy: they must stay until the query is gone.
struct Blob {
  std::string_view bytes;
};

/// A statement being run: step with `row`, then read columns. Resets the statement when it goes. Every failure is a
/// StoreFailure; a broken constraint is a bug of ours and a std::logic_error.
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

  bool row();  ///< false at the end

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
  Database(const std::string& path, Access access);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Prepared once per text and kept, so the texts must be few. Two queries of the same text must not overlap.
  template <class... Values>
  Query query(const std::string& sql, const Values&... values) {
    return Query(connection_.get(), prepared(sql), values...);
  }
  /// Runs a query that gives no rows; says how many rows it changed.
  template <class... Values>
  int change(const std::string& sql, const Values&... values) {
    query(sql, values...).row();
    return changes();
  }
  void script(const std::string& sql);  ///< several statements, unprepared

  /// From now on commits also bring the log's content into the file: as far as readers let them once it has
  /// `pages_wanted` pages, and waiting for readers once it has `pages_max`, so that steady reading cannot make it grow
  /// for ever.
  void checkpoint_at(int pages_wanted, int pages_max);

  /// Whether commits from now on wait for the disk (synchronous = FULL, NORMAL). Not within a transaction.
  void sync_commits(bool wait);

  /// Closing leaves the log and the file as they are, instead of bringing the one into the other.
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
  std::optional<bool> commits_wait_;
  int checkpoint_pages_wanted_ = 0, checkpoint_pages_max_ = 0;
};

}  // namespace queue::sqlite
