#include "server/storage/sqlite/schema.h"

#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "server/storage/sql/tables.h"

namespace storage::sqlite {
namespace {

constexpr const char* jobs_counts =
#include "server/storage/sqlite/jobs_counts.sql"
    ;

/// The rows of a table with a primary key are stored under it, unless they are large.
std::string strict(std::string tables) {
  constexpr std::array large{"documents", "scenes", "reports", "latest_pass", "probe"};
  std::size_t begin = 0;
  while ((begin = tables.find("CREATE TABLE ", begin)) != std::string::npos) {
    const std::size_t name = begin + std::string("CREATE TABLE ").size();
    const std::size_t end = tables.find(");", begin) + 1;
    bool with_row_id = false;
    for (const char* table : large)
      with_row_id |= tables.compare(name, std::string(table).size() + 1, std::string(table) + " ") == 0;
    tables.insert(end, with_row_id ? " STRICT" : " STRICT, WITHOUT ROWID");
    begin = end;
  }
  return tables;
}

}  // namespace

std::string jobs_schema() { return strict(sql::jobs_tables) + jobs_counts; }
std::string deliveries_schema() { return strict(sql::deliveries_tables); }

}  // namespace storage::sqlite
