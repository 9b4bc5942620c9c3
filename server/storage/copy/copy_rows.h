#pragma once
/// Rows of a table in the order of its primary key, without knowledge of its columns. Private to this directory.

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "server/storage/sql/sql_database.h"

namespace storage::copy {

using Value = std::variant<std::monostate, std::int64_t, std::string>;  ///< NULL, INTEGER, TEXT or BLOB
using Row = std::vector<Value>;

struct Column {
  std::string name;
  sql::ColumnType type = sql::ColumnType::integer;
};
struct Table {
  std::string name;
  std::vector<Column> columns;  ///< those of the primary key first
  std::size_t key_columns = 0;
};

/// Copies the rows after the last one of `to`; returns their number.
std::int64_t copy_rows(sql::Transactions& from, sql::Transactions& to, const Table& table);

struct Digest {
  std::int64_t rows = 0;
  std::string sha256;  ///< over all values
  bool operator==(const Digest&) const = default;
};
Digest digest_of(sql::Transactions& database, const Table& table);

}  // namespace storage::copy
