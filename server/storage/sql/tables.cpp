#include "server/storage/sql/tables.h"

#include <algorithm>
#include <sstream>

namespace storage::sql {
namespace {

std::string without_comments(const std::string& script) {
  std::string text;
  std::istringstream lines(script);
  for (std::string line; std::getline(lines, line);) text += line.substr(0, line.find("--")) + ' ';
  return text;
}

/// The parts of the definition of a table, which commas separate.
std::vector<std::string> parts_of(const std::string& definition) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : definition) {
    depth += (c == '(') - (c == ')');
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

void add_part(const std::string& part, Table& table) {
  std::istringstream words(part);
  std::string name, type;
  words >> name >> type;
  if (name == "PRIMARY") {
    std::string columns = part.substr(part.find('(') + 1);
    columns = columns.substr(0, columns.find(')'));
    std::replace(columns.begin(), columns.end(), ',', ' ');
    std::istringstream names(columns);
    for (std::string column; names >> column;) table.key.push_back(column);
    return;
  }
  table.columns.push_back({name, type == "TEXT"   ? ColumnType::text
                                 : type == "BLOB" ? ColumnType::blob
                                                  : ColumnType::integer});
  if (part.find("PRIMARY KEY") != std::string::npos) table.key.push_back(name);
}

}  // namespace

std::vector<Table> tables_of(const std::string& script) {
  const std::string text = without_comments(script), create = "CREATE TABLE ";
  std::vector<Table> tables;
  for (std::size_t at = 0; (at = text.find(create, at)) != std::string::npos;) {
    const std::size_t name = at + create.size(), open = text.find('(', name), end = text.find(';', open);
    Table table{text.substr(name, text.find(' ', name) - name), {}, {}};
    const std::size_t close = text.rfind(')', end);
    for (const std::string& part : parts_of(text.substr(open + 1, close - open - 1))) add_part(part, table);
    tables.push_back(std::move(table));
    at = end;
  }
  return tables;
}

const char* const jobs_tables =
#include "server/storage/sql/jobs_tables.sql"
    ;

const char* const deliveries_tables =
#include "server/storage/sql/deliveries_tables.sql"
    ;

const char* const objects_tables =
#include "server/storage/sql/objects_tables.sql"
    ;

}  // namespace storage::sql
