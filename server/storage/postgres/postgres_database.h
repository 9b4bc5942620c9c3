#pragma once
/// One connection to PostgreSQL and its statements. Private to this directory.
///
/// The connection is in pipeline mode (libpq, "Pipeline Mode"): statements that are posted, and the BEGIN of a
/// transaction, travel with the next statement whose result is needed, so that a transaction of n such statements costs
/// n round trips and one for its end.

#include <libpq-fe.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/storage/sql/sql_database.h"

namespace storage::postgres {

/// A statement of storage::sql in PostgreSQL's words: `$1` for parameters, no INDEXED BY.
std::string translated(const std::string& sql);

struct Free {
  void operator()(PGresult* result) const { PQclear(result); }
  void operator()(PGconn* connection) const { PQfinish(connection); }
};
using Result = std::unique_ptr<PGresult, Free>;
using Connection = std::unique_ptr<PGconn, Free>;

/// With the time limits of this program, unless `dsn` sets others. As PQconnectdb: null without memory.
Connection connect(const std::string& dsn);

/// Another transaction has changed the same rows: the work may run again.
class Conflict : public std::exception {
 public:
  [[nodiscard]] const char* what() const noexcept override { return "a transaction conflicts with another"; }
};

/// Parameters in the binary format.
class Parameters {
 public:
  void set(int position, Oid type, std::optional<std::string> value);
  void clear() { values_.clear(), types_.clear(); }
  [[nodiscard]] int size() const { return static_cast<int>(types_.size()); }
  [[nodiscard]] const std::vector<Oid>& types() const { return types_; }
  [[nodiscard]] const std::vector<std::optional<std::string>>& values() const { return values_; }

 private:
  std::vector<Oid> types_;
  std::vector<std::optional<std::string>> values_;
};

/// Used by one thread at a time. Failures are those of sql::Statement, and Conflict.
class PostgresDatabase final : public sql::Database {
 public:
  /// `dsn`: a connection URI or key-value string of libpq. Throws StoreFailure.
  explicit PostgresDatabase(const std::string& dsn);
  ~PostgresDatabase() override;

  // ---- transactions
  void begin_read();  ///< one state of the database for all reads
  /// `synced`: the commit waits for the disk. `recognised`: it gets a transaction_id().
  void begin_write(bool synced, bool recognised);
  /// Throws Conflict and StoreFailure; where is_broken() then, it may have taken place.
  void commit();
  void roll_back() noexcept;
  /// Waits for the answer of the server. Empty if the transaction is not recognised, or the server did not assign one.
  const std::string& transaction_id();
  /// Differs after a crash of the server, and on its replica: both assign transaction ids again that were not on the
  /// disk. PostgreSQL resets its statistics then.
  [[nodiscard]] const std::string& server_run() const { return server_run_; }

  [[nodiscard]] bool is_broken() const;  ///< the connection is lost

  void script(const std::string& sql);                      ///< several statements outside a transaction
  [[nodiscard]] std::string value(const std::string& sql);  ///< the first column of the only row, as text

  [[nodiscard]] const char* locking() const override { return " FOR UPDATE"; }
  [[nodiscard]] const char* skip_locked() const override { return " FOR UPDATE SKIP LOCKED"; }

  // ---- for its statements
  void prepare(const std::string& name, const std::string& sql, const std::vector<Oid>& types);
  void send(const std::string& name, const Parameters& parameters);
  Result receive();     ///< the result of the statement that was sent last
  void receive_some();  ///< results of posted statements, before they fill the buffers of both sides

 private:
  sql::Statement& prepared(const std::string& sql) override;
  void send_text(const std::string& sql);
  void require_sent(int sent) const;
  Result next_result();
  Result read_all();
  void send_synchronization();
  void synchronize();

  const Connection connection_;
  std::map<std::string, std::unique_ptr<sql::Statement>> statements_;
  int unread_ = 0;             ///< statements without a result yet
  int transaction_id_at_ = 0;  ///< as unread_, the one whose result is the transaction id; 0: none
  std::string transaction_id_, server_run_;
  bool synchronizing_ = false;  ///< a synchronisation point was sent and not read
  bool ended_ = false;          ///< by the server
};

}  // namespace storage::postgres
