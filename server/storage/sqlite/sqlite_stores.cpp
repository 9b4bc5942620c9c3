#include "server/storage/sqlite/sqlite_stores.h"

#include <unistd.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "server/storage/sqlite/connections.h"
#include "tracer/sha256.h"

namespace storage::sqlite {
namespace {

constexpr std::int64_t jobs_schema_version = 14;

/// Names are those of api/docs/http.md and server/queue/job.h. Times are milliseconds since 1970 UTC.
constexpr const char* jobs_schema = R"sql(
-- Small rows clustered by id, which is creation order: pages and text searches read neighbours. Large or repeated
-- values have their own tables.
CREATE TABLE jobs (
  id TEXT NOT NULL PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('render', 'measure')),
  owner TEXT NOT NULL,
  weight INTEGER NOT NULL CHECK (weight > 0),
  name TEXT NOT NULL,
  batch_id TEXT,
  batch_index INTEGER NOT NULL,
  variation TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  ended_at INTEGER,
  moved_at INTEGER NOT NULL,         -- time of the latest move, and its reason: code, a space, detail
  moved_for TEXT NOT NULL DEFAULT '',
  attempt INTEGER NOT NULL CHECK (attempt >= 0),
  max_attempts INTEGER NOT NULL,
  priority INTEGER NOT NULL,
  rank INTEGER NOT NULL,             -- queue::rank_of
  run_after INTEGER,
  not_before INTEGER,
  deadline INTEGER,
  expires_in_s INTEGER,
  expires_at INTEGER,
  expired INTEGER NOT NULL DEFAULT 0,
  webhook_url TEXT,
  webhook_events TEXT,               -- separated by spaces
  keep INTEGER NOT NULL,
  cancel_requested INTEGER NOT NULL,
  suspect INTEGER NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  accuracy TEXT NOT NULL,
  large INTEGER NOT NULL,
  work INTEGER NOT NULL,
  problem_code TEXT,
  problem_detail TEXT,
  artifacts_synced INTEGER NOT NULL DEFAULT 1,
  content_key TEXT,
  use_cache INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  fence INTEGER NOT NULL DEFAULT 0,  -- grows with every claim
  boot_id TEXT,                      -- of the daemon with the latest claim
  lease_until INTEGER                -- end of the latest claim
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_waiting ON jobs (suspect, owner, rank, id, work) WHERE state = 'queued' AND not_before IS NULL;
CREATE INDEX small_jobs_waiting ON jobs (suspect, owner, rank, id)
  WHERE large = 0 AND state = 'queued' AND not_before IS NULL;
CREATE INDEX jobs_delayed ON jobs (not_before, work) WHERE not_before IS NOT NULL;
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE state = 'queued' AND deadline IS NOT NULL;
CREATE INDEX jobs_leased ON jobs (lease_until) WHERE state = 'running' AND lease_until IS NOT NULL;
CREATE INDEX jobs_expiring ON jobs (expires_at) WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL;
CREATE INDEX jobs_ended ON jobs (state, ended_at) WHERE ended_at IS NOT NULL AND expired = 0;
CREATE INDEX jobs_not_kept ON jobs (ended_at) WHERE keep = 0;
CREATE INDEX jobs_expired ON jobs (expires_at) WHERE expired = 1;
CREATE INDEX jobs_by_content ON jobs (content_key, id)
  WHERE content_key IS NOT NULL AND state = 'succeeded' AND expired = 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, id, state) WHERE batch_id IS NOT NULL;

-- The scenes that the documents of batches have in common, under the id of the batch.
CREATE TABLE scenes (id TEXT NOT NULL PRIMARY KEY, document BLOB NOT NULL) STRICT;
CREATE TABLE documents (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  document BLOB NOT NULL,              -- a patch where there is a scene
  scene_id TEXT REFERENCES scenes
) STRICT;
CREATE INDEX documents_by_scene ON documents (scene_id) WHERE scene_id IS NOT NULL;
-- The moves of jobs between states, written by a trigger.
CREATE TABLE moves (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  revision INTEGER NOT NULL,
  at INTEGER NOT NULL,
  state TEXT NOT NULL,
  attempt INTEGER NOT NULL,
  reason TEXT NOT NULL,
  worker TEXT,
  PRIMARY KEY (job_id, revision)
) STRICT, WITHOUT ROWID;
CREATE TABLE reports (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  report TEXT NOT NULL
) STRICT;
CREATE TABLE labels (
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  PRIMARY KEY (key, value, job_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX labels_of_job ON labels (job_id, key, value);
CREATE TABLE artifacts (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  media_type TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX artifacts_by_sha256 ON artifacts (sha256);
CREATE TABLE small_artifacts (sha256 TEXT NOT NULL PRIMARY KEY, bytes BLOB NOT NULL) STRICT;
CREATE TABLE problem_errors (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  pointer TEXT NOT NULL,
  code TEXT NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
-- The uploads that a document names.
CREATE TABLE job_assets (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_assets_by_sha256 ON job_assets (sha256);
CREATE TABLE scene_assets (
  sha256 TEXT NOT NULL,
  scene_id TEXT NOT NULL REFERENCES scenes ON DELETE CASCADE,
  PRIMARY KEY (sha256, scene_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX assets_of_scene ON scene_assets (scene_id);
CREATE TABLE batches (
  id TEXT NOT NULL PRIMARY KEY,
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  sweep TEXT NOT NULL,
  created_at INTEGER NOT NULL,
  max_failed INTEGER,
  size INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
-- First replies under idempotency keys.
CREATE TABLE replies (
  owner TEXT NOT NULL,
  route TEXT NOT NULL,
  key TEXT NOT NULL,
  request_sha256 TEXT NOT NULL,
  status INTEGER NOT NULL,
  location TEXT NOT NULL,
  body TEXT NOT NULL,
  expires_at INTEGER NOT NULL,
  PRIMARY KEY (owner, route, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX replies_by_expiry ON replies (expires_at);

-- Maintained by triggers, so that limits are checked without counting jobs.
CREATE TABLE job_counts (
  state TEXT NOT NULL PRIMARY KEY,
  jobs INTEGER NOT NULL DEFAULT 0,
  work INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;
INSERT INTO job_counts (state) VALUES ('queued'), ('running'), ('succeeded'), ('failed'), ('cancelled');
CREATE TABLE owner_usage (
  owner TEXT NOT NULL PRIMARY KEY,
  queued_jobs INTEGER NOT NULL,
  running_jobs INTEGER NOT NULL DEFAULT 0,
  artifact_bytes INTEGER NOT NULL DEFAULT 0,
  pass INTEGER NOT NULL DEFAULT 0    -- see JobTransitions::claim
) STRICT, WITHOUT ROWID;
-- The pass at which the latest claim was made.
CREATE TABLE latest_pass (pass INTEGER NOT NULL) STRICT;
INSERT INTO latest_pass VALUES (0);
CREATE TABLE artifact_total (bytes INTEGER NOT NULL) STRICT;  -- equal artifacts count once
INSERT INTO artifact_total VALUES (0);
CREATE TABLE queued_by_priority (priority INTEGER NOT NULL PRIMARY KEY, jobs INTEGER NOT NULL) STRICT;
CREATE TRIGGER job_inserted AFTER INSERT ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  INSERT INTO owner_usage (owner, queued_jobs) VALUES (new.owner, new.state = 'queued')
    ON CONFLICT DO UPDATE SET queued_jobs = queued_jobs + excluded.queued_jobs;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER job_moved AFTER UPDATE OF state, priority ON jobs
    WHEN old.state <> new.state OR old.priority <> new.priority BEGIN
  UPDATE job_counts SET jobs = jobs - 1, work = work - old.work WHERE state = old.state;
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  UPDATE owner_usage SET queued_jobs = queued_jobs + (new.state = 'queued') - (old.state = 'queued'),
    running_jobs = running_jobs + (new.state = 'running') - (old.state = 'running') WHERE owner = new.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE old.state = 'queued' AND priority = old.priority;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER move_written AFTER UPDATE OF state ON jobs WHEN old.state <> new.state AND new.keep = 1 BEGIN
  INSERT INTO moves VALUES (new.id, new.revision, new.moved_at, new.state, new.attempt, new.moved_for,
    iif(new.state = 'running', new.boot_id, NULL));
END;
CREATE TRIGGER job_deleted AFTER DELETE ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs - 1, work = work - old.work WHERE state = old.state;
  UPDATE owner_usage SET queued_jobs = queued_jobs - (old.state = 'queued') WHERE owner = old.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE old.state = 'queued' AND priority = old.priority;
END;
CREATE TRIGGER last_of_batch_deleted AFTER DELETE ON jobs WHEN old.batch_id IS NOT NULL BEGIN
  DELETE FROM batches WHERE id = old.batch_id AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = old.batch_id);
END;
CREATE TRIGGER last_document_of_scene_deleted AFTER DELETE ON documents WHEN old.scene_id IS NOT NULL BEGIN
  DELETE FROM scenes WHERE id = old.scene_id AND NOT EXISTS
    (SELECT 1 FROM documents INDEXED BY documents_by_scene WHERE scene_id = old.scene_id);
END;
CREATE TRIGGER artifact_inserted AFTER INSERT ON artifacts BEGIN
  UPDATE owner_usage SET artifact_bytes = artifact_bytes + new.bytes WHERE owner = new.owner;
  UPDATE artifact_total SET bytes = bytes + new.bytes WHERE 1 =
    (SELECT count(*) FROM (SELECT 1 FROM artifacts WHERE sha256 = new.sha256 LIMIT 2));
END;
CREATE TRIGGER artifact_deleted AFTER DELETE ON artifacts BEGIN
  UPDATE owner_usage SET artifact_bytes = artifact_bytes - old.bytes WHERE owner = old.owner;
  UPDATE artifact_total SET bytes = bytes - old.bytes WHERE NOT EXISTS
    (SELECT 1 FROM artifacts WHERE sha256 = old.sha256);
END;

CREATE TABLE probe (writes INTEGER NOT NULL) STRICT;
INSERT INTO probe VALUES (0);
)sql";

/// Sets up the connection and creates the tables in an empty file.
void prepare_jobs(Database& database, const std::string& path) {
  prepare(database, path, jobs_schema_version, jobs_schema);
  // The size limit returns space to the disk after a burst of large documents.
  database.script("PRAGMA cache_size = -8000; PRAGMA journal_size_limit = 67108864;");
  // 4 MB as the default of SQLite: a longer log makes checkpoints that delay all requests. 32 MB: a few large
  // documents.
  database.checkpoint_at(1000, 8000);
}

std::string file_of(const std::string& directory) { return directory + "/whittle.db"; }

/// The database of a directory with images was deleted or emptied. A new one would be followed by their loss.
void require_no_artifacts(const std::filesystem::path& directory) {
  for (const auto& part : std::filesystem::directory_iterator(directory)) {
    if (!part.is_directory() || part.path().filename().string().size() != 2) continue;
    for (const auto& file : std::filesystem::directory_iterator(part)) {
      if (!tracer::is_sha256(file.path().filename().string())) continue;
      throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable,
                                file_of(directory) + " is missing or empty, but " + part.path().string() +
                                    " has images: restore a backup, or use another directory");
    }
  }
}

std::unique_ptr<Database> open_writer(const std::string& path, bool synchronous) {
  auto database = std::make_unique<Database>(path, Database::Access::read_write, synchronous);
  if (is_new(*database)) require_no_artifacts(std::filesystem::path(path).parent_path());
  prepare_jobs(*database, path);
  return database;
}

constexpr std::size_t small_bytes_max = 32u << 10;

/// The whole content if it is small and can be read.
std::optional<std::string> read_small(int fd) {
  std::array<char, small_bytes_max + 1> bytes;
  std::size_t size = 0;
  while (size < bytes.size()) {
    const ssize_t got = ::pread(fd, bytes.data() + size, bytes.size() - size, static_cast<off_t>(size));
    if (got < 0) return std::nullopt;
    if (got == 0) return std::string(bytes.data(), size);
    size += static_cast<std::size_t>(got);
  }
  return std::nullopt;
}

std::optional<std::string> read_row(Database& database, const std::string& sha256) {
  Query row = database.query("SELECT bytes FROM small_artifacts WHERE sha256 = ?", sha256);
  if (!row.row()) return std::nullopt;
  return row.text(0);
}

class BytesReader final : public queue::ArtifactReader {
 public:
  explicit BytesReader(std::string bytes) : bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= bytes_.size() ? 0 : bytes_.copy(into, size, offset);
  }

 private:
  const std::string bytes_;
};

}  // namespace

void check_jobs_file(const std::string& directory) {
  if (!check_file(file_of(directory), jobs_schema_version) && std::filesystem::is_directory(directory))
    require_no_artifacts(directory);
}

Connections::Connections(const std::string& directory, const SqliteSettings& settings)
    : lock(directory),
      writer(open_writer(file_of(directory), settings.synchronous),
             settings.health == nullptr ? own_health : *settings.health),
      reader(file_of(directory), settings.read_connections) {}

SqliteStores::SqliteStores(const std::string& directory, SqliteSettings settings)
    : connections_(std::make_unique<Connections>(directory, settings)),
      jobs_(make_job_store(*connections_)),
      statistics_(make_job_statistics(*connections_)),
      transitions_(make_job_transitions(*connections_)),
      batches_(make_batch_store(*connections_)),
      maintenance_(make_maintenance_store(*connections_)) {}
SqliteStores::~SqliteStores() = default;

// ---- SmallArtifactStore

queue::ArtifactStore::Stored SmallArtifactStore::put(int fd, bool durable) {
  const std::optional<std::string> bytes = read_small(fd);
  if (!bytes) return large_.put(fd, durable);
  const std::string sha256 = tracer::sha256_hex(*bytes);
  const auto work = [&](Database& database) {
    return database.change(
        "INSERT INTO small_artifacts VALUES (?, ?) ON CONFLICT DO UPDATE SET bytes = excluded.bytes"
        " WHERE bytes <> excluded.bytes",
        sha256, Blob{*bytes});
  };
  connections_.writer.run(work, Synced::with_next);
  return {sha256, bytes->size()};
}

void SmallArtifactStore::sync(const std::string& sha256) {
  if (!find(sha256)) large_.sync(sha256);
}

std::unique_ptr<queue::ArtifactReader> SmallArtifactStore::open(const std::string& sha256) {
  std::optional<std::string> bytes = find(sha256);
  if (!bytes) return large_.open(sha256);
  if (tracer::sha256_hex(*bytes) != sha256) return nullptr;
  return std::make_unique<BytesReader>(*std::move(bytes));
}

std::unique_ptr<queue::ArtifactReader> SmallArtifactStore::open_unverified(const std::string& sha256) {
  std::optional<std::string> bytes = find(sha256);
  if (!bytes) return large_.open_unverified(sha256);
  return std::make_unique<BytesReader>(*std::move(bytes));
}

void SmallArtifactStore::remove(const std::string& sha256) {
  if (!find(sha256)) return large_.remove(sha256);
  const auto work = [&](Database& database) {
    return database.change("DELETE FROM small_artifacts WHERE sha256 = ?", sha256);
  };
  connections_.writer.run(work, Synced::with_next);
}

std::optional<std::string> SmallArtifactStore::find(const std::string& sha256) {
  return connections_.reader.run([&](Database& database) { return read_row(database, sha256); });
}

}  // namespace storage::sqlite
