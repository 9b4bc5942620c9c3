R"sql(
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
)sql"
