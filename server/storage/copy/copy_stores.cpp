#include "server/storage/copy/copy_stores.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <exception>
#include <limits>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "server/storage/copy/copy_rows.h"
#include "server/storage/files/durable_file.h"
#include "server/storage/sql/tables.h"
#include "server/storage/sqlite/database.h"
#include "server/support/descriptor.h"

namespace storage::copy {
namespace {

using Reader = std::unique_ptr<queue::ArtifactReader>;

/// The tables of a script in its order, in which each comes after those that it refers to; without those of one row,
/// which are counters of the process itself.
std::vector<Table> tables_of(const char* script) {
  sqlite::SqliteDatabase memory(":memory:", sqlite::SqliteDatabase::Access::read_write);
  memory.script(script);
  std::vector<Table> tables;
  for (const std::string& name : memory.texts("SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY rowid")) {
    Table table{name, {}, 0};
    sql::Query columns = memory.query("SELECT name, type, pk FROM pragma_table_info(?) ORDER BY pk = 0, pk, cid", name);
    while (columns.row()) {
      if (columns.integer(2) > 0) ++table.key_columns;
      const std::string type = columns.text(1);
      using enum sql::ColumnType;
      table.columns.push_back({columns.text(0), type == "TEXT" ? text : type == "BLOB" ? blob : integer});
    }
    if (table.key_columns > 0) tables.push_back(std::move(table));
  }
  return tables;
}

void copy_tables(sql::Transactions& from, sql::Transactions& to, const char* script, const Report& report) {
  for (const Table& table : tables_of(script)) {
    const std::int64_t copied = copy_rows(from, to, table);
    if (copied > 0) report(table.name + ": " + std::to_string(copied) + " rows copied");
  }
}

void compare_tables(sql::Transactions& from, sql::Transactions& to, const char* script) {
  for (const Table& table : tables_of(script)) {
    const Digest source = digest_of(from, table), copy = digest_of(to, table);
    if (source == copy) continue;
    throw queue::StoreFailure(
        "the copy of the table " + table.name + " has " + std::to_string(copy.rows) + " rows and the source " +
        std::to_string(source.rows) +
        ", or their content differs: one of them was changed meanwhile; delete the copy and start again");
  }
}

/// The first column of a query without parameters.
std::set<std::string> names(sql::Transactions& database, const std::string& query) {
  const auto found = database.texts(query);
  return {found.begin(), found.end()};
}

/// True if it exists, and its bytes are those of its name.
bool is_intact(const Reader& reader, const std::string& sha256) {
  try {
    return reader && files::hash_of(files::contents_of(*reader)).sha256 == sha256;
  } catch (const queue::StoreFailure& failure) {
    if (failure.kind != queue::StoreFailure::Kind::damaged) throw;
    return false;
  }
}

/// The bytes in memory, as a store reads an artifact from a descriptor.
support::Descriptor in_memory(const queue::ArtifactReader& reader) {
  support::Descriptor memory(::memfd_create("artifact", MFD_CLOEXEC));
  std::string piece(1u << 20, '\0');
  for (std::uint64_t done = 0; done < reader.size_bytes();) {
    const std::size_t count = reader.read(done, piece.data(), piece.size());
    const ssize_t written = ::pwrite(memory.get(), piece.data(), count, static_cast<off_t>(done));
    if (count == 0 || written <= 0) throw std::system_error(errno, std::generic_category(), "copy of an artifact");
    done += static_cast<std::uint64_t>(written);
  }
  return memory;
}

/// Empty, or the reason why it was not copied.
std::string copy_artifact(const End& from, const End& to, const std::string& sha256) {
  if (is_intact(to.artifacts.open(sha256), sha256)) return {};
  const Reader source = from.artifacts.open(sha256);
  if (!source) return "is missing or damaged";
  const support::Descriptor bytes = in_memory(*source);
  if (to.artifacts.put(bytes.get()).sha256 != sha256) return "is damaged";
  return is_intact(to.artifacts.open(sha256), sha256) ? "" : "was damaged by the copy";
}

std::string copy_asset(const End& from, const End& to, const std::string& sha256) {
  if (to.assets.use(sha256) && is_intact(to.assets.open(sha256), sha256)) return {};
  const Reader source = from.assets.open(sha256);
  if (!source) return "is missing";
  const auto put = to.assets.put(sha256, files::contents_of(*source));
  if (put == queue::AssetStore::Put::other_bytes) return "is damaged";
  if (put == queue::AssetStore::Put::quota_exceeded) return "exceeds the limit of uploads of the copy";
  return is_intact(to.assets.open(sha256), sha256) ? "" : "was damaged by the copy";
}

using CopyOne = std::string (*)(const End& from, const End& to, const std::string& sha256);

/// Several at once, since each waits for the store most of the time.
void copy_files(const End& from, const End& to, const std::set<std::string>& names, const std::string& what,
                CopyOne copy_one, const Report& report) {
  constexpr int threads_max = 8;
  constexpr std::size_t report_every = 1000, reasons_max = 10;
  const std::vector<std::string> all(names.begin(), names.end());
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::size_t done = 0, failures = 0;
  std::string reasons;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < all.size(); i = next++) {
      try {
        const std::string reason = copy_one(from, to, all[i]);
        const std::lock_guard lock(mutex);
        if (!reason.empty() && ++failures <= reasons_max) reasons += "\n  " + all[i] + " " + reason;
        if (++done % report_every == 0)
          report(what + ": " + std::to_string(done) + " of " + std::to_string(all.size()));
      } catch (...) {
        const std::lock_guard lock(mutex);
        failure = std::current_exception();
        next = all.size();
      }
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < threads_max; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
  if (failures > 0) {
    throw queue::StoreFailure(std::to_string(failures) + " " + what +
                              " cannot be copied; start the daemon with the source and delete or retry "
                              "the jobs that name them:" +
                              reasons);
  }
  report(what + ": " + std::to_string(all.size()) + " copied and compared");
}

std::set<std::string> assets_of(const End& end) {
  std::set<std::string> all = names(end.jobs, "SELECT sha256 FROM job_assets UNION SELECT sha256 FROM scene_assets");
  for (int part = 0; part < queue::AssetStore::parts; ++part) {
    for (std::string& name : end.assets.unused_since(part, std::numeric_limits<std::int64_t>::max()))
      all.insert(std::move(name));
  }
  return all;
}

}  // namespace

void copy_all(const End& from, const End& to, const Report& report) {
  copy_tables(from.jobs, to.jobs, sql::jobs_tables, report);
  copy_tables(from.deliveries, to.deliveries, sql::deliveries_tables, report);
  copy_files(from, to, names(from.jobs, "SELECT DISTINCT sha256 FROM artifacts"), "artifacts", &copy_artifact, report);
  copy_files(from, to, assets_of(from), "assets", &copy_asset, report);
  compare_tables(from.jobs, to.jobs, sql::jobs_tables);
  compare_tables(from.deliveries, to.deliveries, sql::deliveries_tables);
  report("all tables are equal");
}

}  // namespace storage::copy
