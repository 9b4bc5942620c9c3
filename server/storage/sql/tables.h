#pragma once
/// The tables and indexes of the stores, as statements of SQLite; a database with other types of columns replaces
/// INTEGER (64 bits), TEXT (ordered by bytes) and BLOB, and removes the options of tables: the rows of one with a
/// primary key are stored under it (WITHOUT ROWID), unless they are large. Names are those of api/docs/http.md and
/// server/queue/job.h. Times are milliseconds since 1970 UTC.
///
/// A database adds what the stores only read: the view `owners` (owner, queued_jobs, running_jobs, artifact_bytes,
/// pass), `job_counts` (state, jobs, work), `queued_by_priority` (priority, jobs) and `artifact_total` (bytes; equal
/// artifacts count once); the table `owner_usage` (owner, pass) with a row for each owner of a job; and triggers that
/// write `moves`, and delete batches with their last job and scenes with their last document.

namespace storage::sql {

inline constexpr const char* jobs_tables =
#include "server/storage/sql/jobs_tables.sql"
    ;
inline constexpr const char* deliveries_tables =
#include "server/storage/sql/deliveries_tables.sql"
    ;
/// For objects::ObjectIndex; only where nodes share their files.
inline constexpr const char* objects_tables =
#include "server/storage/sql/objects_tables.sql"
    ;

}  // namespace storage::sql
