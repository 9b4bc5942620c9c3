#pragma once
/// The tables and indexes of the stores, as statements of SQLite; a database with other types of columns replaces
/// INTEGER (64 bits), TEXT (ordered by bytes) and BLOB. Names are those of api/docs/http.md and server/queue/job.h.
/// Times are milliseconds since 1970 UTC.
///
/// A database adds what the stores only read: the view `owners` (owner, queued_jobs, running_jobs, artifact_bytes,
/// pass), `job_counts` (state, jobs, work), `queued_by_priority` (priority, jobs) and `artifact_total` (bytes; equal
/// artifacts count once); the table `owner_usage` (owner, pass) with a row for each owner of a job; and triggers that
/// write `moves`, and delete batches with their last job and scenes with their last document.

namespace storage::sql {

extern const char* const jobs_tables;
extern const char* const deliveries_tables;
extern const char* const objects_tables;  ///< for objects::ObjectIndex; only where nodes share their files

}  // namespace storage::sql
