#include "server/storage/sqlite/sqlite_stores.h"

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "server/storage/sql/tables.h"
#include "server/storage/sqlite/connections.h"
#include "server/support/file_io.h"
#include "tracer/sha256.h"

namespace storage::sqlite {
namespace {

constexpr std::int64_t jobs_schema_version = 15, deliveries_schema_version = 3;
constexpr const char* jobs_counts =
#include "server/storage/sqlite/jobs_counts.sql"
    ;

/// Sets up the connection and creates the tables in an empty file.
void prepare_jobs(SqliteDatabase& database, const std::string& path) {
  prepare(database, path, jobs_schema_version, std::string(sql::jobs_tables) + jobs_counts);
  // The size limit returns space to the disk after a burst of large documents.
  database.script("PRAGMA cache_size = -8000; PRAGMA journal_size_limit = 67108864;");
  database.script(jobs_views);
  // 4 MB as the default of SQLite: a longer log makes checkpoints that delay all requests. 32 MB: a few large
  // documents.
  database.checkpoint_at(2000, 16000);
}

std::string jobs_file(const std::string& directory) { return directory + "/whittle.db"; }
std::string deliveries_file(const std::string& directory) { return directory + "/webhooks.db"; }

/// The database of a directory with images was deleted or emptied. A new one would be followed by their loss.
void require_no_artifacts(const std::filesystem::path& directory) {
  for (const auto& part : std::filesystem::directory_iterator(directory)) {
    if (!part.is_directory() || part.path().filename().string().size() != 2) continue;
    for (const auto& file : std::filesystem::directory_iterator(part)) {
      if (!tracer::is_sha256(file.path().filename().string())) continue;
      throw queue::StoreFailure(jobs_file(directory) + " is missing or empty, but " + part.path().string() +
                                " has images: restore a backup, or use another directory");
    }
  }
}

std::unique_ptr<SqliteDatabase> open_jobs(const std::string& path, bool synchronous) {
  auto database = std::make_unique<SqliteDatabase>(path, SqliteDatabase::Access::read_write, synchronous);
  if (is_new(*database)) require_no_artifacts(std::filesystem::path(path).parent_path());
  prepare_jobs(*database, path);
  return database;
}

std::unique_ptr<SqliteDatabase> open_deliveries(const std::string& path, bool synchronous) {
  auto database = std::make_unique<SqliteDatabase>(path, SqliteDatabase::Access::read_write, synchronous);
  prepare(*database, path, deliveries_schema_version, sql::deliveries_tables);
  return database;
}

constexpr std::size_t small_bytes_max = 32u << 10;

/// The whole content if it is small and can be read.
std::optional<std::string> read_small(int fd) {
  std::array<char, small_bytes_max + 1> bytes;
  const ssize_t count = support::read_at(fd, 0, bytes.data(), bytes.size());
  if (count < 0 || count > static_cast<ssize_t>(small_bytes_max)) return std::nullopt;
  return std::string(bytes.data(), static_cast<std::size_t>(count));
}

}  // namespace

void check_files(const std::string& directory) {
  if (!check_file(jobs_file(directory), jobs_schema_version) && std::filesystem::is_directory(directory))
    require_no_artifacts(directory);
  (void)check_file(deliveries_file(directory), deliveries_schema_version);
}

Connections::Connections(const std::string& directory, const SqliteSettings& settings)
    : lock(directory),
      health(settings.health == nullptr ? own_health : *settings.health),
      jobs(open_jobs(jobs_file(directory), settings.synchronous), health, jobs_file(directory),
           settings.read_connections),
      deliveries(open_deliveries(deliveries_file(directory), settings.synchronous), health) {}

SqliteStores::SqliteStores(const std::string& directory, SqliteSettings settings)
    : connections_(std::make_unique<Connections>(directory, settings)),
      stores_(std::make_unique<queue::JobStores>(connections_->jobs)),
      deliveries_(std::make_unique<queue::DeliveryStore>(connections_->deliveries)) {}
SqliteStores::~SqliteStores() = default;

sql::Transactions& SqliteStores::transactions() const { return connections_->jobs; }
sql::Transactions& SqliteStores::delivery_transactions() const { return connections_->deliveries; }

// ---- SmallArtifactStore

queue::ArtifactStore::Stored SmallArtifactStore::put(int fd, bool durable) {
  const std::optional<std::string> bytes = read_small(fd);
  if (!bytes) return large_.put(fd, durable);
  const std::string sha256 = tracer::sha256_hex(*bytes);
  rows_.change(sql::Synced::with_next,
               "INSERT INTO small_artifacts VALUES (?, ?) ON CONFLICT DO UPDATE SET bytes = excluded.bytes"
               " WHERE bytes <> excluded.bytes",
               sha256, sql::Blob{*bytes});
  return {sha256, bytes->size()};
}

void SmallArtifactStore::sync(const std::string& sha256) {
  if (!find(sha256)) large_.sync(sha256);
}

std::unique_ptr<queue::ArtifactReader> SmallArtifactStore::open(const std::string& sha256, bool verified) {
  std::optional<std::string> bytes = find(sha256);
  if (!bytes) return large_.open(sha256, verified);
  if (verified && tracer::sha256_hex(*bytes) != sha256) return nullptr;
  return std::make_unique<queue::MemoryReader>(*std::move(bytes));
}

void SmallArtifactStore::remove(const std::string& sha256) {
  if (!find(sha256)) return large_.remove(sha256);
  rows_.change(sql::Synced::with_next, "DELETE FROM small_artifacts WHERE sha256 = ?", sha256);
}

std::optional<std::string> SmallArtifactStore::find(const std::string& sha256) {
  return rows_.first_text("SELECT bytes FROM small_artifacts WHERE sha256 = ?", sha256);
}

}  // namespace storage::sqlite
