#include "server/storage/sqlite/database.h"

#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "server/queue/job_store.h"

namespace storage::sqlite {
namespace {

[[noreturn]] void fail(sqlite3* connection, int result) {
  // SQLite does not note the system's error when a COMMIT fails; errno still has it.
  const int last_error = errno;
  const int noted_error = sqlite3_system_errno(connection);
  const int system_error = noted_error != 0 ? noted_error : last_error;
  std::string what = sqlite3_errmsg(connection);
  const int primary = result & 0xff;
  if (primary == SQLITE_CONSTRAINT || primary == SQLITE_MISUSE || primary == SQLITE_ERROR) throw std::logic_error(what);
  if (primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN) what += std::string(": ") + std::strerror(system_error);
  if (primary == SQLITE_FULL) throw queue::StoreFailure(queue::StoreFailure::Kind::full, what);
  // Only a failed write is FULL to SQLite; a quota, a file size limit or a full disk at a sync is an I/O error.
  if (primary == SQLITE_IOERR) throw queue::StoreFailure(queue::StoreFailure::kind_of(system_error), what);
  throw queue::StoreFailure(what);
}

class SqliteStatement final : public sql::Statement {
 public:
  SqliteStatement(sqlite3* connection, const std::string& sql) : connection_(connection) {
    check(sqlite3_prepare_v3(connection, sql.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &statement_, nullptr));
  }
  ~SqliteStatement() override { sqlite3_finalize(statement_); }
  SqliteStatement(SqliteStatement&&) = delete;

  void bind(int position, std::int64_t value) override { check(sqlite3_bind_int64(statement_, position, value)); }
  void bind(int position, const std::string& value) override {
    check(sqlite3_bind_text64(statement_, position, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  }
  void bind(int position, sql::Blob value) override {
    check(sqlite3_bind_blob64(statement_, position, value.bytes.data(), value.bytes.size(), SQLITE_STATIC));
  }
  void bind_null(int, sql::ColumnType) override {}  // as after reset

  bool row() override {
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) fail(connection_, result);
    return result == SQLITE_ROW;
  }
  [[nodiscard]] int changes() const override { return sqlite3_changes(connection_); }

  [[nodiscard]] bool is_null(int column) const override {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
  }
  [[nodiscard]] std::int64_t integer(int column) const override { return sqlite3_column_int64(statement_, column); }
  [[nodiscard]] std::string text(int column) const override {
    const void* bytes = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes == nullptr ? std::string()
                            : std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
  }

  void reset() noexcept override {
    sqlite3_reset(statement_);  // repeats the error of the last step, which was thrown already
    sqlite3_clear_bindings(statement_);
  }

 private:
  void check(int result) const {
    if (result != SQLITE_OK) fail(connection_, result);
  }

  sqlite3* connection_;
  sqlite3_stmt* statement_ = nullptr;
};

constexpr std::int64_t application_id = 0x57687474;  // "Whtt"

std::int64_t pragma(SqliteDatabase& database, const std::string& name) { return database.number("PRAGMA " + name); }

/// The version of the file, 0 of an empty one. Throws StoreFailure for another than `version`, or for the file of
/// another program.
std::int64_t read_version(SqliteDatabase& database, const std::string& path, std::int64_t version) {
  if (!is_new(database) && pragma(database, "application_id") != application_id) {
    throw queue::StoreFailure(path + " is a database of another program, or of a version without application_id");
  }
  const std::int64_t found = pragma(database, "user_version");
  if (found != 0 && found != version) {
    throw queue::StoreFailure(path + " was written by " + (found > version ? "a newer" : "an older") +
                              " program: its schema has version " + std::to_string(found) +
                              ", this program supports version " + std::to_string(version) + " only");
  }
  return found;
}

}  // namespace

// ---- SqliteDatabase

void SqliteDatabase::Close::operator()(sqlite3* connection) const { sqlite3_close_v2(connection); }

SqliteDatabase::SqliteDatabase(const std::string& path, Access access, bool synchronous) : synchronous_(synchronous) {
  // The callers use a connection from one thread at a time, so SQLite's own locks are not needed.
  const int mode = access == Access::read_write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  sqlite3* connection = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &connection, mode | SQLITE_OPEN_NOMUTEX, nullptr);
  connection_.reset(connection);
  if (connection == nullptr) throw std::bad_alloc();
  if (result != SQLITE_OK) {
    throw queue::StoreFailure("cannot open " + path + ": " + sqlite3_errmsg(connection));
  }
  sqlite3_extended_result_codes(connection, 1);
  sqlite3_busy_timeout(connection, 5000);
  // SQLite 3.40.1 has the WAL-reset bug, which needs two connections that checkpoint: only the writer does, and nothing
  // is mapped.
  script("PRAGMA mmap_size = 0; PRAGMA temp_store = MEMORY;");
  if (!synchronous) script("PRAGMA synchronous = OFF;");
  if (access == Access::read_only) {
    script("PRAGMA wal_autocheckpoint = 0;");
    keep_log();
  }
}

void SqliteDatabase::sync_commits(bool wait) {
  if (!synchronous_ || commits_wait_ == wait) return;
  script(wait ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL");
  commits_wait_ = wait;
}

void SqliteDatabase::keep_log() { sqlite3_db_config(connection_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr); }

SqliteDatabase::~SqliteDatabase() { statements_.clear(); }

void SqliteDatabase::script(const std::string& sql) {
  const int result = sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (result != SQLITE_OK) fail(connection_.get(), result);
}

void SqliteDatabase::checkpoint_at(int pages_target, int pages_max) {
  checkpoint_pages_target_ = pages_target;
  checkpoint_pages_max_ = pages_max;
  const auto after_commit = [](void* self, sqlite3* connection, const char* name, int pages) {
    const auto* database = static_cast<const SqliteDatabase*>(self);
    if (pages < database->checkpoint_pages_target_) return SQLITE_OK;
    const bool wait = pages >= database->checkpoint_pages_max_;
    sqlite3_wal_checkpoint_v2(connection, name, wait ? SQLITE_CHECKPOINT_RESTART : SQLITE_CHECKPOINT_PASSIVE, nullptr,
                              nullptr);
    return SQLITE_OK;  // the commit is valid without the checkpoint
  };
  sqlite3_wal_hook(connection_.get(), after_commit, this);
}

sql::Statement& SqliteDatabase::prepared(const std::string& sql) {
  auto& statement = statements_[sql];
  if (statement == nullptr) statement = std::make_unique<SqliteStatement>(connection_.get(), sql);
  return *statement;
}

bool SqliteDatabase::in_transaction() const { return sqlite3_get_autocommit(connection_.get()) == 0; }

// ---- schemas

bool is_new(SqliteDatabase& database) { return pragma(database, "schema_version") == 0; }

bool check_file(const std::string& path, std::int64_t version) {
  if (::access(path.c_str(), F_OK) != 0) return false;
  SqliteDatabase database(path, SqliteDatabase::Access::read_only);
  return read_version(database, path, version) != 0;
}

void prepare(SqliteDatabase& database, const std::string& path, std::int64_t version, const std::string& schema) {
  // Before any change: WAL would change the file of another program.
  const std::int64_t found = read_version(database, path, version);
  // A small job changes some twenty pages, each in a few bytes, and a commit writes and sums up whole pages. Half of
  // the default of SQLite costs a service of small renders 2 % less; with 1024 bytes, pages of jobs are read slower.
  database.script("PRAGMA page_size = 2048; PRAGMA journal_mode = WAL; PRAGMA foreign_keys = ON;");
  database.sync_commits(true);  // FULL: with WAL, no acknowledged commit is lost at power loss
  if (found == version) return;
  database.script("BEGIN IMMEDIATE;" + schema + "PRAGMA application_id = " + std::to_string(application_id) +
                  "; PRAGMA user_version = " + std::to_string(version) + "; COMMIT;");
}

}  // namespace storage::sqlite
