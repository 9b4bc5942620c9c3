#include "server/storage/postgres/postgres_schema.h"

#include <utility>
#include <vector>

#include "server/queue/job_store.h"
#include "server/storage/postgres/postgres_database.h"
#include "server/storage/sql/tables.h"

namespace storage::postgres {
namespace {

/// Functions that run with every change. Statements inside them are cheaper than calls of other functions.
///
/// number_events() returns -1 where another caller numbers: callers that wait for it would wait for its commit.
constexpr const char* functions =
#include "server/storage/postgres/functions.sql"
    ;

/// Counts and triggers. A counter that every transaction changes would make all of them wait for each other's commit.
/// So each adds its changes as rows of `count_changes`, and add_up_counts() moves those of ended transactions to
/// `counts`. `counted` divides them exactly: of the transactions before pg_snapshot_xmin none runs any more.
constexpr const char* counts_and_triggers =
#include "server/storage/postgres/counts_and_triggers.sql"
    ;

/// The state that nodes share beside the jobs (queue::ClusterStore). Transactions end in another order than they begin,
/// so a sequence has gaps that are filled later, and a reader would miss events. Triggers therefore write events
/// without a number, in the transaction of the change; number_events() moves those of ended transactions to `events`,
/// one caller at a time. `until` is as `counted`. Of one job, `seq` has the order of the changes, because each locks
/// its row.
constexpr const char* cluster_tables =
#include "server/storage/postgres/cluster_tables.sql"
    ;

/// queue::TaskStore. A crash of the server empties these tables, so that their content is written once and not twice.
constexpr const char* tasks_tables =
#include "server/storage/postgres/tasks_tables.sql"
    ;

/// The tables of storage::sql with the types of PostgreSQL.
std::string with_types(std::string tables) {
  for (const auto& [type, replacement] : {std::pair{" INTEGER", " BIGINT"},
                                          {" BLOB", " BYTEA"},
                                          {" TEXT", " TEXT COLLATE \"C\""},
                                          {", WITHOUT ROWID", ""},
                                          {" STRICT", ""}}) {
    for (std::size_t at = 0; (at = tables.find(type, at)) != std::string::npos; at += std::string(replacement).size())
      tables.replace(at, std::string(type).size(), replacement);
  }
  return tables;
}

/// The statements from each version to the next, from version 1 on.
const std::vector<std::string>& migrations() {
  static const std::vector<std::string> all{functions};
  return all;
}

constexpr int copying = -1;  // in place of the version

void create(PostgresDatabase& database, int version) {
  database.script(std::string("BEGIN; ") + functions + with_types(sql::jobs_tables) +
                  with_types(sql::deliveries_tables) + with_types(sql::objects_tables) + counts_and_triggers +
                  cluster_tables + tasks_tables +
                  "CREATE TABLE whittle_schema (version INTEGER NOT NULL); INSERT INTO whittle_schema VALUES (" +
                  std::to_string(version) + "); COMMIT");
}

[[noreturn]] void fail(const std::string& what) { throw queue::StoreFailure("PostgreSQL: " + what); }

[[noreturn]] void fail_unfinished() {
  fail("the database has an unfinished copy of other data; repeat the command with --copy-to to finish it");
}

/// 0 of a database without tables. Throws where this program does not support it.
int read_version(PostgresDatabase& database) {
  if (database.value("SELECT current_setting('server_version_num')::int >= 150000") != "t")
    fail("version 15 or newer is needed, and the server has " + database.value("SHOW server_version"));
  if (database.value("SHOW server_encoding") != "UTF8") fail("the encoding of the database must be UTF8");
  if (database.value("SELECT to_regclass('whittle_schema') IS NOT NULL") != "t") {
    if (database.value("SELECT to_regclass('jobs') IS NULL") != "t") fail("the database has tables of another program");
    return 0;
  }
  const int found = std::stoi(database.value("SELECT version FROM whittle_schema"));
  if (found > schema_version + 1) {
    fail("the schema has version " + std::to_string(found) + ", this program supports versions up to " +
         std::to_string(schema_version + 1));
  }
  return found;
}

}  // namespace

void prepare_schema(const std::string& dsn) {
  PostgresDatabase database(dsn);
  database.script("SET lock_timeout = 0");  // another node creates the tables
  database.script("SELECT pg_advisory_lock(hashtext('whittle'), hashtext('schema'))");  // until the connection ends
  const int found = read_version(database);
  if (found == 0) return create(database, schema_version);
  if (found == copying) fail_unfinished();
  for (int version = found; version < schema_version; ++version) {
    database.script("BEGIN; " + migrations().at(static_cast<std::size_t>(version) - 1) +
                    "; UPDATE whittle_schema SET version = " + std::to_string(version + 1) + "; COMMIT");
  }
}

void check_schema(const std::string& dsn) {
  PostgresDatabase database(dsn);
  if (read_version(database) == copying) fail_unfinished();
}

void prepare_copy(const std::string& dsn) {
  PostgresDatabase database(dsn);
  database.script("SELECT pg_advisory_lock(hashtext('whittle'), hashtext('schema'))");
  const int found = read_version(database);
  if (found == 0) return create(database, copying);
  if (found != copying) fail("the database has tables already; a copy needs an empty one");
}

void finish_copy(const std::string& dsn) {
  PostgresDatabase(dsn).script("UPDATE whittle_schema SET version = " + std::to_string(schema_version));
}

}  // namespace storage::postgres
