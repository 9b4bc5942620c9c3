#include "server/storage/postgres/postgres_database.h"

#include <endian.h>

#include <array>
#include <cctype>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "server/queue/job_store.h"

namespace storage::postgres {
namespace {

// From pg_type.dat: constant since the first versions.
constexpr Oid oid_of_int8 = 20, oid_of_text = 25, oid_of_bytea = 17;
constexpr int binary = 1;

[[noreturn]] void fail_unavailable(const std::string& what) { throw queue::StoreFailure("PostgreSQL: " + what); }

std::string trimmed(std::string message) {
  while (!message.empty() && message.back() == '\n') message.pop_back();
  return message;
}

std::string sql_state(const PGresult* result) {
  const char* const field = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  return field == nullptr ? "" : field;
}

/// Throws for a failed statement. The classes are those of PostgreSQL's appendix A, "Error Codes".
[[noreturn]] void fail(const PGresult* result) {
  const std::string state = sql_state(result);
  const std::string what = trimmed(PQresultErrorMessage(result));
  if (state == "40001" || state == "40P01") throw Conflict();  // serialization failure, deadlock
  const std::string error_class = state.substr(0, 2);
  const bool is_bug = error_class == "22" || error_class == "23" || error_class == "42";
  if (is_bug) throw std::logic_error("PostgreSQL: " + what);
  using Kind = queue::StoreFailure::Kind;
  throw queue::StoreFailure(state == "53100" ? Kind::full : Kind::unavailable, "PostgreSQL: " + what);
}

class PostgresStatement final : public sql::Statement {
 public:
  PostgresStatement(PostgresDatabase& database, std::string name, std::string sql)
      : database_(database), name_(std::move(name)), sql_(std::move(sql)) {}

  void bind(int position, std::int64_t value) override {
    const std::uint64_t big_endian = htobe64(static_cast<std::uint64_t>(value));
    std::string bytes(sizeof big_endian, '\0');
    std::memcpy(bytes.data(), &big_endian, sizeof big_endian);
    parameters_.set(position, oid_of_int8, std::move(bytes));
  }
  void bind(int position, const std::string& value) override { parameters_.set(position, oid_of_text, value); }
  void bind(int position, sql::Blob value) override {
    parameters_.set(position, oid_of_bytea, std::string(value.bytes));
  }
  void bind_null(int position, sql::ColumnType type) override {
    constexpr std::array oids{oid_of_int8, oid_of_text, oid_of_bytea};
    parameters_.set(position, oids[static_cast<std::size_t>(type)], std::nullopt);
  }

  bool row() override {
    if (result_ == nullptr) {
      send();
      result_ = database_.receive();
      row_ = -1;
    }
    return ++row_ < PQntuples(result_.get());
  }
  void post() override {
    send();
    database_.receive_some();
  }
  [[nodiscard]] int changes() const override { return std::atoi(PQcmdTuples(result_.get())); }

  [[nodiscard]] bool is_null(int column) const override { return PQgetisnull(result_.get(), row_, column) != 0; }
  /// Also of a smaller integer or a boolean.
  [[nodiscard]] std::int64_t integer(int column) const override {
    const std::string bytes = text(column);
    if (bytes.empty()) return 0;
    std::uint64_t value = (bytes.front() & 0x80) != 0 ? ~std::uint64_t{0} : 0;
    for (const char byte : bytes) value = value << 8 | static_cast<unsigned char>(byte);
    return static_cast<std::int64_t>(value);
  }
  [[nodiscard]] std::string text(int column) const override {
    return {PQgetvalue(result_.get(), row_, column),
            static_cast<std::size_t>(PQgetlength(result_.get(), row_, column))};
  }

  void reset() noexcept override {
    result_.reset();
    parameters_.clear();
  }

 private:
  void send() {
    if (!is_prepared_) database_.prepare(name_, sql_, parameters_.types());
    is_prepared_ = true;
    database_.send(name_, parameters_);
  }

  PostgresDatabase& database_;
  const std::string name_, sql_;
  bool is_prepared_ = false;
  Parameters parameters_;
  Result result_;
  int row_ = -1;
};

}  // namespace

Connection connect(const std::string& dsn) {
  // A cut is seen within 3.2 s: the first two limits are for the connection and for data that was sent, the others for
  // a wait for an answer. What `dsn` sets wins, as it comes last.
  constexpr std::array keywords{"connect_timeout",  "tcp_user_timeout", "keepalives_idle", "keepalives_interval",
                                "keepalives_count", "application_name", "client_encoding", "dbname"};
  const std::array<const char*, keywords.size()> values{"2", "3000", "1", "1", "3", "whittled", "UTF8", dsn.c_str()};
  std::array<const char*, keywords.size() + 1> names{}, settings{};
  std::copy(keywords.begin(), keywords.end(), names.begin());
  std::copy(values.begin(), values.end(), settings.begin());
  Connection connection(PQconnectdbParams(names.data(), settings.data(), 1));
  // Otherwise libpq prints messages, such as that of a server that ends a session, to standard error.
  if (connection != nullptr)
    PQsetNoticeProcessor(
        connection.get(), [](void*, const char*) {}, nullptr);
  return connection;
}

std::string translated(const std::string& sql) {
  const std::string hint = " INDEXED BY ";
  std::string text;
  int parameters = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < sql.size(); ++i) {
    if (sql[i] == '\'') quoted = !quoted;
    if (!quoted && sql.compare(i, hint.size(), hint) == 0) {
      i = sql.find_first_of(" )", i + hint.size());
      if (i == std::string::npos) break;
      --i;
    } else if (!quoted && sql[i] == '?') {
      text += '$';
      const bool numbered = i + 1 < sql.size() && std::isdigit(static_cast<unsigned char>(sql[i + 1])) != 0;
      if (!numbered) text += std::to_string(++parameters);
    } else {
      text += sql[i];
    }
  }
  return text;
}

void Parameters::set(int position, Oid type, std::optional<std::string> value) {
  const auto size = static_cast<std::size_t>(position);
  if (values_.size() < size) values_.resize(size), types_.resize(size);
  types_[size - 1] = type;
  values_[size - 1] = std::move(value);
}

PostgresDatabase::PostgresDatabase(const std::string& dsn) : connection_(connect(dsn)) {
  if (connection_ == nullptr) throw std::bad_alloc();
  if (PQstatus(connection_.get()) != CONNECTION_OK) fail_unavailable(trimmed(PQerrorMessage(connection_.get())));
  // The server ends the transaction of a node that was cut off, and with it its locks. Messages of triggers would go to
  // standard error.
  script(
      "SET client_min_messages = error; SET idle_in_transaction_session_timeout = '10s'; SET lock_timeout = '10s';"
      " SET tcp_keepalives_idle = 2; SET tcp_keepalives_interval = 1; SET tcp_keepalives_count = 5;"
      " SET tcp_user_timeout = 7000");
  server_run_ = value("SELECT stats_reset::text FROM pg_stat_bgwriter");
  if (PQpipelineStatus(connection_.get()) == PQ_PIPELINE_OFF) fail_unavailable("no pipeline mode");
}

PostgresDatabase::~PostgresDatabase() { statements_.clear(); }

void PostgresDatabase::begin_read() { send_text("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"); }

void PostgresDatabase::begin_write(bool synced, bool recognised) {
  send_text("BEGIN");
  if (!synced) send_text("SET LOCAL synchronous_commit = off");
  transaction_id_.clear();
  transaction_id_at_ = 0;
  if (!recognised) return;
  send_text("SELECT pg_current_xact_id()::text");
  transaction_id_at_ = unread_;
}

const std::string& PostgresDatabase::transaction_id() {
  if (transaction_id_at_ > 0) receive();
  return transaction_id_;
}

void PostgresDatabase::commit() {
  send_text("COMMIT");
  send_synchronization();
  const Result ended = read_all();
  if (std::string(PQcmdStatus(ended.get())) != "COMMIT") throw Conflict();
  synchronize();
}

void PostgresDatabase::roll_back() noexcept {
  try {
    if (is_broken()) return;
    synchronize();
    send_text("ROLLBACK");
    receive();
    synchronize();
  } catch (...) {
    // The connection is lost, or the statement of the transaction that failed was reported already.
  }
}

bool PostgresDatabase::is_broken() const { return ended_ || PQstatus(connection_.get()) != CONNECTION_OK; }

void PostgresDatabase::script(const std::string& sql) {
  const bool in_pipeline = PQpipelineStatus(connection_.get()) != PQ_PIPELINE_OFF;
  if (in_pipeline) PQexitPipelineMode(connection_.get());
  const Result result(PQexec(connection_.get(), sql.c_str()));
  if (in_pipeline) PQenterPipelineMode(connection_.get());
  const ExecStatusType status = PQresultStatus(result.get());
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) fail(result.get());
}

std::string PostgresDatabase::value(const std::string& sql) {
  PQexitPipelineMode(connection_.get());
  const Result result(PQexec(connection_.get(), sql.c_str()));
  PQenterPipelineMode(connection_.get());
  if (PQresultStatus(result.get()) != PGRES_TUPLES_OK) fail(result.get());
  return PQntuples(result.get()) == 1 ? PQgetvalue(result.get(), 0, 0) : "";
}

sql::Statement& PostgresDatabase::prepared(const std::string& sql) {
  auto& statement = statements_[sql];
  if (statement == nullptr) {
    statement = std::make_unique<PostgresStatement>(*this, "s" + std::to_string(statements_.size()), translated(sql));
  }
  return *statement;
}

void PostgresDatabase::require_sent(int sent) const {
  if (sent != 1) fail_unavailable(trimmed(PQerrorMessage(connection_.get())));
}

void PostgresDatabase::prepare(const std::string& name, const std::string& sql, const std::vector<Oid>& types) {
  require_sent(
      PQsendPrepare(connection_.get(), name.c_str(), sql.c_str(), static_cast<int>(types.size()), types.data()));
  ++unread_;
}

void PostgresDatabase::send(const std::string& name, const Parameters& parameters) {
  std::vector<const char*> values;
  std::vector<int> sizes;
  for (const auto& value : parameters.values()) {
    values.push_back(value ? value->data() : nullptr);
    sizes.push_back(value ? static_cast<int>(value->size()) : 0);
  }
  const std::vector<int> formats(values.size(), binary);
  require_sent(PQsendQueryPrepared(connection_.get(), name.c_str(), parameters.size(), values.data(), sizes.data(),
                                   formats.data(), binary));
  ++unread_;
}

void PostgresDatabase::send_text(const std::string& sql) {
  require_sent(PQsendQueryParams(connection_.get(), sql.c_str(), 0, nullptr, nullptr, nullptr, nullptr, 0));
  ++unread_;
}

/// The result of the oldest unread statement; throws where that failed.
Result PostgresDatabase::next_result() {
  Result result(PQgetResult(connection_.get()));
  if (result == nullptr) result.reset(PQgetResult(connection_.get()));
  if (result == nullptr) fail_unavailable(trimmed(PQerrorMessage(connection_.get())));
  --unread_;
  const bool is_transaction_id = transaction_id_at_ == 1;
  if (transaction_id_at_ > 0) --transaction_id_at_;
  const ExecStatusType status = PQresultStatus(result.get());
  if (status == PGRES_PIPELINE_ABORTED) throw Conflict();  // an earlier failure was thrown already
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) {
    // Operator intervention: the server reports that it ends the session before it closes the connection.
    ended_ = ended_ || sql_state(result.get()).starts_with("57P");
    fail(result.get());
  }
  if (is_transaction_id) transaction_id_ = PQgetvalue(result.get(), 0, 0);
  const Result end(PQgetResult(connection_.get()));  // null: the end of the results of this statement
  return result;
}

Result PostgresDatabase::receive() {
  require_sent(PQsendFlushRequest(connection_.get()));
  require_sent(PQflush(connection_.get()) == 0 ? 1 : 0);
  return read_all();
}

Result PostgresDatabase::read_all() {
  Result last;
  while (unread_ > 0) last = next_result();
  return last;
}

void PostgresDatabase::receive_some() {
  constexpr int unread_max = 100;
  if (unread_ >= unread_max) receive();
}

void PostgresDatabase::send_synchronization() {
  require_sent(PQpipelineSync(connection_.get()));
  synchronizing_ = true;
}

/// Reads everything up to a synchronisation point, after which statements are executed again after a failure.
void PostgresDatabase::synchronize() {
  if (!synchronizing_) send_synchronization();
  synchronizing_ = false;
  while (true) {
    const Result result(PQgetResult(connection_.get()));
    if (result == nullptr) {
      if (is_broken()) fail_unavailable(trimmed(PQerrorMessage(connection_.get())));
      continue;
    }
    if (PQresultStatus(result.get()) == PGRES_PIPELINE_SYNC) break;
  }
  unread_ = 0;
}

}  // namespace storage::postgres
