#pragma once
/// A connection to an SQL database and its statements, as the stores of the queue use them. The statements are written
/// once for SQLite and PostgreSQL: with `?` or `?1` for parameters, integers of 64 bits in place of booleans,
/// and CAST around sums. What differs is a function of Database.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace storage::sql {

/// Bytes bound without a copy: they must outlive the query.
struct Blob {
  std::string_view bytes;
};

enum class ColumnType { integer, text, blob };
template <class T>
inline constexpr ColumnType column_type = std::is_integral_v<T>            ? ColumnType::integer
                                          : std::is_same_v<T, std::string> ? ColumnType::text
                                                                           : ColumnType::blob;

/// A prepared statement, which its Database owns. Positions of parameters begin at 1, columns at 0. Every failure of
/// the environment is a StoreFailure; a violated constraint is a bug of the caller and a std::logic_error.
class Statement {
 public:
  virtual ~Statement() = default;
  virtual void bind(int position, std::int64_t value) = 0;
  virtual void bind(int position, const std::string& value) = 0;
  virtual void bind(int position, Blob value) = 0;
  virtual void bind_null(int position, ColumnType type) = 0;
  virtual bool row() = 0;  ///< moves to the next row, at the first call by running it; false at the end
  /// Runs a statement that has no result. It may be sent with the next statement or with the end of the transaction,
  /// which then throws its failure.
  virtual void post() { row(); }
  [[nodiscard]] virtual int changes() const = 0;  ///< rows that it has changed
  [[nodiscard]] virtual bool is_null(int column) const = 0;
  [[nodiscard]] virtual std::int64_t integer(int column) const = 0;
  [[nodiscard]] virtual std::string text(int column) const = 0;  ///< also of a BLOB: the bytes as they are
  virtual void reset() noexcept = 0;                             ///< ends the run and clears the parameters
};

/// "?, ?, ?"
inline std::string marks(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += i == 0 ? "?" : ", ?";
  return text;
}

/// A run of a statement: step with `row`, then read columns. The destructor resets the statement.
///
/// Values of an enumeration are texts: name_of(value) and, for take(), from_text(text, value) in its namespace.
class Query {
 public:
  /// Binds `values` to the statement's parameters, in order.
  template <class... Values>
  explicit Query(Statement& statement, const Values&... values) : statement_(statement) {
    [[maybe_unused]] int position = 0;
    (bind(++position, values), ...);
  }
  ~Query() { statement_.reset(); }
  Query(Query&&) = delete;

  template <class T>
  void bind(int position, const T& value) {
    if constexpr (std::is_integral_v<T>) {
      statement_.bind(position, static_cast<std::int64_t>(value));
    } else if constexpr (std::is_enum_v<T>) {
      statement_.bind(position, std::string(name_of(value)));
    } else {
      statement_.bind(position, value);
    }
  }
  template <class T>
  void bind(int position, const std::optional<T>& value) {
    if (value) {
      bind(position, *value);
    } else {
      statement_.bind_null(position, column_type<T>);
    }
  }

  bool row() {
    taken_ = 0;
    return statement_.row();
  }
  void post() { statement_.post(); }
  /// `read(query)` for each of the remaining rows.
  template <class Read>
  auto all(const Read& read) {
    std::vector<std::invoke_result_t<Read, Query&>> values;
    while (row()) values.push_back(read(*this));
    return values;
  }
  std::vector<std::string> texts() {  ///< the first column of all remaining rows
    return all([](const Query& row) { return row.text(0); });
  }
  [[nodiscard]] int changes() const { return statement_.changes(); }

  [[nodiscard]] bool is_null(int column) const { return statement_.is_null(column); }
  [[nodiscard]] std::int64_t integer(int column) const { return statement_.integer(column); }
  [[nodiscard]] std::string text(int column) const { return statement_.text(column); }
  /// Reads the columns of the row in their order, from the first one or the one after the last that was taken.
  template <class... Values>
  void take(Values&... values) {
    (take_next(values), ...);
  }

 private:
  template <class T>
  void take_next(T& value) {
    const int column = taken_++;
    if constexpr (std::is_same_v<T, bool>) {
      value = integer(column) != 0;
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>(integer(column));
    } else if constexpr (std::is_enum_v<T>) {
      from_text(text(column), value);
    } else {
      value = text(column);
    }
  }
  template <class T>
  void take_next(std::optional<T>& value) {
    value.reset();
    is_null(taken_) ? void(++taken_) : take_next(value.emplace());
  }

  int taken_ = 0;
  Statement& statement_;
};

/// Used by one thread at a time.
class Database {
 public:
  Database() = default;
  virtual ~Database() = default;
  Database(Database&&) = delete;

  /// Each text is prepared once and kept, so the texts must be few. Two queries of the same text must not overlap.
  template <class... Values>
  Query query(const std::string& sql, const Values&... values) {
    return Query(prepared(sql), values...);
  }
  /// Runs a statement without result rows; returns the number of changed rows.
  template <class... Values>
  int change(const std::string& sql, const Values&... values) {
    Query changed = query(sql, values...);
    changed.row();
    return changed.changes();
  }

  /// The first column of all rows, and of the first row, where there is one.
  template <class... Values>
  std::vector<std::string> texts(const std::string& sql, const Values&... values) {
    return query(sql, values...).texts();
  }
  template <class... Values>
  std::optional<std::string> first_text(const std::string& sql, const Values&... values) {
    Query row = query(sql, values...);
    return row.row() ? std::optional(row.text(0)) : std::nullopt;
  }

  /// The first column of the first row, which there must be.
  template <class... Values>
  std::int64_t number(const std::string& sql, const Values&... values) {
    Query row = query(sql, values...);
    row.row();
    return row.integer(0);
  }

  /// Like change, for statements whose number of changed rows is not needed; may be sent with the next one.
  template <class... Values>
  void post(const std::string& sql, const Values&... values) {
    query(sql, values...).post();
  }

  // ---- Where several processes write at once, a transaction locks the rows that it has read and will change. These
  // end a SELECT; they are empty where one connection does all writes.
  [[nodiscard]] virtual const char* locking() const { return ""; }      ///< waits for other transactions
  [[nodiscard]] virtual const char* skip_locked() const { return ""; }  ///< leaves out the rows that others have locked
  [[nodiscard]] bool is_shared() const { return *locking() != '\0'; }

 protected:
  virtual Statement& prepared(const std::string& sql) = 0;
};

/// When a change survives power loss. It survives the death of the process in any case, and a change that was synced
/// makes all before it durable.
enum class Synced {
  now,        ///< before the call returns
  with_next,  ///< with the next synced one: power loss may undo it
};

inline Synced synced(bool durable) { return durable ? Synced::now : Synced::with_next; }

/// The connections to one database. Thread-safe. Throws StoreFailure, and what the work throws; then nothing was
/// changed.
class Transactions {
 public:
  virtual ~Transactions() = default;

  /// Runs `work(database)` inside a transaction and returns its value once that is committed and synced as requested.
  /// `work` may run again, after its writes were undone.
  template <class Work>
  auto write(Work work, Synced synced = Synced::now) {
    std::optional<std::invoke_result_t<Work, Database&>> result;
    run_write([&](Database& database) { result.emplace(work(database)); }, synced);
    return *std::move(result);
  }

  /// `work(database)` reads one state of the database, with every write of this process that returned before.
  template <class Work>
  auto read(Work work) {
    std::optional<std::invoke_result_t<Work, Database&>> result;
    run_read([&](Database& database) { result.emplace(work(database)); });
    return *std::move(result);
  }

  /// Transactions of one statement, as the functions of Database with these names.
  template <class... Values>
  int change(Synced synced, const std::string& sql, const Values&... values) {
    return write([&](Database& database) { return database.change(sql, values...); }, synced);
  }
  template <class... Values>
  int change(const std::string& sql, const Values&... values) {
    return change(Synced::now, sql, values...);
  }
  template <class... Values>
  std::vector<std::string> texts(const std::string& sql, const Values&... values) {
    return read([&](Database& database) { return database.texts(sql, values...); });
  }
  template <class... Values>
  std::optional<std::string> first_text(const std::string& sql, const Values&... values) {
    return read([&](Database& database) { return database.first_text(sql, values...); });
  }

 protected:
  using Run = std::function<void(Database&)>;
  virtual void run_write(const Run& work, Synced synced) = 0;
  virtual void run_read(const Run& work) = 0;
};

}  // namespace storage::sql
