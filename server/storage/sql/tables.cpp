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

const char* const jobs_tables = R"sql(
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
  formats TEXT NOT NULL,
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
);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_waiting ON jobs (suspect, owner, rank, id, work) WHERE state = 'queued' AND not_before IS NULL;
CREATE INDEX small_jobs_waiting ON jobs (suspect, owner, rank, id)
  WHERE large = 0 AND state = 'queued' AND not_before IS NULL;
CREATE INDEX jobs_delayed ON jobs (not_before, work) WHERE not_before IS NOT NULL;
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE state = 'queued' AND deadline IS NOT NULL;
CREATE INDEX jobs_expiring ON jobs (expires_at) WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL;
CREATE INDEX jobs_ended ON jobs (state, ended_at) WHERE ended_at IS NOT NULL AND expired = 0;
CREATE INDEX jobs_not_kept ON jobs (ended_at) WHERE keep = 0 AND ended_at IS NOT NULL;
CREATE INDEX jobs_expired ON jobs (expires_at) WHERE expired = 1;
CREATE INDEX jobs_by_content ON jobs (content_key, id)
  WHERE content_key IS NOT NULL AND state = 'succeeded' AND expired = 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, id, state) WHERE batch_id IS NOT NULL;

-- The scenes that the documents of batches have in common, under the id of the batch.
CREATE TABLE scenes (id TEXT NOT NULL PRIMARY KEY, document BLOB NOT NULL);
CREATE TABLE documents (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  document BLOB NOT NULL,              -- a patch where there is a scene
  scene_id TEXT REFERENCES scenes
);
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
);
CREATE TABLE reports (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  report TEXT NOT NULL
);
CREATE TABLE labels (
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  PRIMARY KEY (key, value, job_id)
);
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
);
CREATE INDEX artifacts_by_sha256 ON artifacts (sha256);
CREATE TABLE problem_errors (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  pointer TEXT NOT NULL,
  code TEXT NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
);
-- The uploads that a document names.
CREATE TABLE job_assets (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
);
CREATE INDEX job_assets_by_sha256 ON job_assets (sha256);
CREATE TABLE scene_assets (
  sha256 TEXT NOT NULL,
  scene_id TEXT NOT NULL REFERENCES scenes ON DELETE CASCADE,
  PRIMARY KEY (sha256, scene_id)
);
CREATE INDEX assets_of_scene ON scene_assets (scene_id);
CREATE TABLE batches (
  id TEXT NOT NULL PRIMARY KEY,
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  sweep TEXT NOT NULL,
  created_at INTEGER NOT NULL,
  max_failed INTEGER,
  size INTEGER NOT NULL
);
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
);
CREATE INDEX replies_by_expiry ON replies (expires_at);
-- The pass at which the latest claim was made.
CREATE TABLE latest_pass (pass INTEGER NOT NULL);
INSERT INTO latest_pass VALUES (0);
CREATE TABLE probe (writes INTEGER NOT NULL);
INSERT INTO probe VALUES (0);
)sql";

const char* const deliveries_tables = R"sql(
CREATE TABLE subscriptions (
  job_id TEXT NOT NULL PRIMARY KEY,
  url TEXT NOT NULL,
  events TEXT NOT NULL  -- separated by spaces
);
CREATE TABLE deliveries (
  id TEXT NOT NULL PRIMARY KEY,
  job_id TEXT NOT NULL,
  event TEXT NOT NULL,
  url TEXT NOT NULL,
  host TEXT NOT NULL,  -- queue::host_of(url)
  body TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('pending', 'delivered', 'abandoned')),
  created_at INTEGER NOT NULL,
  next_attempt_at INTEGER CHECK ((next_attempt_at IS NOT NULL) = (state = 'pending'))
);
CREATE INDEX deliveries_of_job ON deliveries (job_id, id);
CREATE INDEX deliveries_due ON deliveries (host, next_attempt_at, id) WHERE state = 'pending';
CREATE INDEX deliveries_by_age ON deliveries (created_at) WHERE state <> 'pending';
CREATE TABLE attempts (
  delivery_id TEXT NOT NULL REFERENCES deliveries ON DELETE CASCADE,
  number INTEGER NOT NULL,
  at INTEGER NOT NULL,
  duration_ms INTEGER NOT NULL,
  status INTEGER NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (delivery_id, number)
);
)sql";

const char* const objects_tables = R"sql(
CREATE TABLE objects (
  kind TEXT NOT NULL CHECK (kind IN ('artifact', 'asset')),
  sha256 TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  used_at INTEGER NOT NULL,
  finished INTEGER NOT NULL,  -- 0 while the bytes are stored or removed
  PRIMARY KEY (kind, sha256)
);
CREATE TABLE object_totals (kind TEXT NOT NULL PRIMARY KEY, bytes INTEGER NOT NULL);
INSERT INTO object_totals (kind, bytes) VALUES ('asset', 0);
)sql";

}  // namespace storage::sql
