#include "server/storage/copy/copy_rows.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "tracer/sha256.h"

namespace storage::copy {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& after_each = "") {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word).append(after_each);
  return text;
}

std::vector<std::string> names_of(const std::vector<Column>& columns) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.push_back(column.name);
  return names;
}

std::string marks(std::size_t count) { return joined(std::vector<std::string>(count, "?")); }

Row read_row(const sql::Query& query, const std::vector<Column>& columns) {
  Row row;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const int column = static_cast<int>(i);
    if (query.is_null(column)) {
      row.emplace_back();
    } else if (columns[i].type == sql::ColumnType::integer) {
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

std::vector<Column> key_columns(const Table& table) {
  std::vector<Column> columns;
  for (const std::string& name : table.key) {
    columns.push_back(*std::find_if(table.columns.begin(), table.columns.end(),
                                    [&](const Column& column) { return column.name == name; }));
  }
  return columns;
}

Row key_of(const Row& row, const Table& table) {
  Row key;
  for (const std::string& name : table.key) {
    const auto column =
        std::find_if(table.columns.begin(), table.columns.end(), [&](const Column& each) { return each.name == name; });
    key.push_back(row[static_cast<std::size_t>(column - table.columns.begin())]);
  }
  return key;
}

/// The greatest key; empty where there are no rows.
Row last_key(sql::Transactions& database, const Table& table) {
  return database.read([&](sql::Database& connection) {
    sql::Query query = connection.query("SELECT " + joined(table.key) + " FROM " + table.name + " ORDER BY " +
                                        joined(table.key, " DESC") + " LIMIT 1");
    return query.row() ? read_row(query, key_columns(table)) : Row();
  });
}

void insert_rows(sql::Transactions& database, const Table& table, const std::vector<Row>& rows) {
  const std::string insert = "INSERT INTO " + table.name + " (" + joined(names_of(table.columns)) + ") VALUES (" +
                             marks(table.columns.size()) + ")";
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

}  // namespace

int page_rows_of(const Table& table) {
  const bool has_blobs = std::any_of(table.columns.begin(), table.columns.end(),
                                     [](const Column& column) { return column.type == sql::ColumnType::blob; });
  return has_blobs || table.name == "reports" ? 16 : 1000;
}

void for_each_page(sql::Transactions& database, const Table& table, Row after, int page_rows,
                   const std::function<void(const std::vector<Row>&)>& each) {
  const std::string select = "SELECT " + joined(names_of(table.columns)) + " FROM " + table.name;
  const std::string order = " ORDER BY " + joined(table.key) + " LIMIT " + std::to_string(page_rows);
  const std::string first = select + order;
  const std::string next = select + " WHERE (" + joined(table.key) + ") > (" + marks(table.key.size()) + ")" + order;
  const std::vector<Column> key = key_columns(table);
  for (;;) {
    const std::vector<Row> rows = database.read([&](sql::Database& connection) {
      sql::Query query = connection.query(after.empty() ? first : next);
      for (std::size_t i = 0; i < after.size(); ++i) bind_value(query, static_cast<int>(i) + 1, after[i], key[i].type);
      std::vector<Row> page;
      while (query.row()) page.push_back(read_row(query, table.columns));
      return page;
    });
    if (rows.empty()) return;
    each(rows);
    after = key_of(rows.back(), table);
  }
}

std::int64_t copy_rows(sql::Transactions& from, sql::Transactions& to, const Table& table) {
  std::int64_t copied = 0;
  for_each_page(from, table, last_key(to, table), page_rows_of(table), [&](const std::vector<Row>& rows) {
    insert_rows(to, table, rows);
    copied += static_cast<std::int64_t>(rows.size());
  });
  return copied;
}

Digest digest_of(sql::Transactions& database, const Table& table) {
  Digest digest;
  tracer::Sha256 hash;
  for_each_page(database, table, {}, page_rows_of(table), [&](const std::vector<Row>& rows) {
    for (const Row& row : rows)
      for (const Value& value : row) add(value, hash);
    digest.rows += static_cast<std::int64_t>(rows.size());
  });
  digest.sha256 = hash.hex();
  return digest;
}

}  // namespace storage::copy
