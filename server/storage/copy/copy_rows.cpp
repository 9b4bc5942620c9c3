#include "server/storage/copy/copy_rows.h"

#include <algorithm>
#include <optional>

#include "tracer/sha256.h"

namespace storage::copy {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& after_each = "") {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word).append(after_each);
  return text;
}

/// Names of the first columns.
std::vector<std::string> names_of(const Table& table, std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) names.push_back(table.columns[i].name);
  return names;
}

/// The first values of a row.
Row read_row(const sql::Query& query, const Table& table, std::size_t count) {
  Row row;
  for (std::size_t i = 0; i < count; ++i) {
    const int column = static_cast<int>(i);
    if (query.is_null(column)) {
      row.emplace_back();
    } else if (table.columns[i].type == sql::ColumnType::integer) {
      row.emplace_back(query.integer(column));
    } else {
      row.emplace_back(query.text(column));
    }
  }
  return row;
}

void bind_value(sql::Query& query, int position, const Value& value, sql::ColumnType type) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return query.bind(position, *number);
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr && type == sql::ColumnType::integer) return query.bind(position, std::optional<std::int64_t>());
  if (text == nullptr && type == sql::ColumnType::text) return query.bind(position, std::optional<std::string>());
  if (text == nullptr) return query.bind(position, std::optional<sql::Blob>());
  if (type == sql::ColumnType::blob) return query.bind(position, sql::Blob{*text});
  query.bind(position, *text);
}

/// The greatest key; empty where there are no rows.
Row last_key(sql::Transactions& database, const Table& table) {
  return database.read([&](sql::Database& connection) {
    const std::vector<std::string> key = names_of(table, table.key_columns);
    sql::Query query = connection.query("SELECT " + joined(key) + " FROM " + table.name + " ORDER BY " +
                                        joined(key, " DESC") + " LIMIT 1");
    return query.row() ? read_row(query, table, table.key_columns) : Row();
  });
}

void insert_rows(sql::Transactions& database, const Table& table, const std::vector<Row>& rows) {
  const std::string insert = "INSERT INTO " + table.name + " (" + joined(names_of(table, table.columns.size())) +
                             ") VALUES (" + sql::marks(table.columns.size()) + ")";
  database.write([&](sql::Database& connection) {
    for (const Row& row : rows) {
      sql::Query query = connection.query(insert);
      for (std::size_t i = 0; i < row.size(); ++i)
        bind_value(query, static_cast<int>(i) + 1, row[i], table.columns[i].type);
      query.post();
    }
    return true;
  });
}

void add(const Value& value, tracer::Sha256& hash) {
  std::string text = "-";
  if (const auto* number = std::get_if<std::int64_t>(&value)) text = "i" + std::to_string(*number);
  if (const auto* bytes = std::get_if<std::string>(&value)) text = "t" + std::to_string(bytes->size()) + ":" + *bytes;
  text += ';';
  hash.add(text.data(), text.size());
}

/// Number of rows to read at once: few of tables with large values.
int page_rows_of(const Table& table) {
  const bool has_blobs =
      std::ranges::any_of(table.columns, [](const Column& column) { return column.type == sql::ColumnType::blob; });
  return has_blobs || table.name == "reports" ? 16 : 1000;
}

/// Calls `each` for all rows from a key on (empty: from the first), a page at a time.
template <class Each>
void for_each_page(sql::Transactions& database, const Table& table, Row after, const Each& each) {
  const std::string select = "SELECT " + joined(names_of(table, table.columns.size())) + " FROM " + table.name;
  const std::string key = joined(names_of(table, table.key_columns));
  const std::string order = " ORDER BY " + key + " LIMIT " + std::to_string(page_rows_of(table));
  const std::string first = select + order;
  const std::string next = select + " WHERE (" + key + ") > (" + sql::marks(table.key_columns) + ")" + order;
  for (;;) {
    const std::vector<Row> rows = database.read([&](sql::Database& connection) {
      sql::Query query = connection.query(after.empty() ? first : next);
      for (std::size_t i = 0; i < after.size(); ++i)
        bind_value(query, static_cast<int>(i) + 1, after[i], table.columns[i].type);
      std::vector<Row> page;
      while (query.row()) page.push_back(read_row(query, table, table.columns.size()));
      return page;
    });
    if (rows.empty()) return;
    each(rows);
    after = rows.back();
    after.resize(table.key_columns);
  }
}

}  // namespace

std::int64_t copy_rows(sql::Transactions& from, sql::Transactions& to, const Table& table) {
  std::int64_t copied = 0;
  for_each_page(from, table, last_key(to, table), [&](const std::vector<Row>& rows) {
    insert_rows(to, table, rows);
    copied += static_cast<std::int64_t>(rows.size());
  });
  return copied;
}

Digest digest_of(sql::Transactions& database, const Table& table) {
  Digest digest;
  tracer::Sha256 hash;
  for_each_page(database, table, {}, [&](const std::vector<Row>& rows) {
    for (const Row& row : rows)
      for (const Value& value : row) add(value, hash);
    digest.rows += static_cast<std::int64_t>(rows.size());
  });
  digest.sha256 = hash.hex();
  return digest;
}

}  // namespace storage::copy
