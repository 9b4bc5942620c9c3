#pragma once
/// Rows of jobs, read and written inside a transaction. Private to this directory.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/queue/job_store.h"

namespace queue {

inline void from_text(const std::string& text, JobState& state) { state = job_state(text).value(); }
inline void from_text(const std::string& text, JobKind& kind) { kind = job_kind(text).value(); }

/// Words in one column, separated by spaces.
std::string joined(const std::vector<std::string>& words);
std::vector<std::string> split(const std::string& text);

/// The document is a patch of the scene of that id; null: a complete document.
void insert_job(sql::Database& database, const Job& job, const std::string& document,
                const std::optional<std::string>& scene_id);
void insert_labels(sql::Database& database, const std::string& id, const std::map<std::string, std::string>& labels);
void insert_report(sql::Database& database, const std::string& id, const std::string& report);
void insert_problem(sql::Database& database, const std::string& id, const Problem& problem);
/// Precondition: the row of the job exists.
void insert_artifacts(sql::Database& database, const std::string& id, const std::vector<Artifact>& artifacts);

/// Keeps other transactions from changing the job before the end of this one. Without effect where there is one writer.
void lock_job(sql::Database& database, const std::string& id);
std::optional<Job> read_job(sql::Database& database, const std::string& id);
std::optional<JobSummary> read_summary(sql::Database& database, const std::string& id);
/// Deletes the job if it does not run; none if it was not deleted.
std::optional<JobSummary> delete_job(sql::Database& database, const std::string& id);
std::vector<Artifact> read_artifacts(sql::Database& database, const std::string& id);
std::int64_t read_artifact_bytes(sql::Database& database);  ///< sum over all jobs

/// Growth of an owner's pass by a claim with weight 1: all weights up to 10 divide it.
inline constexpr std::int64_t pass_of_turn = 2520;

/// An UPDATE of a running job (as all ends not before the start, also if the clock was set back) that returns to
/// queued, or to cancelled where that was requested; ?1 is now. The reason, the attempt and the condition follow.
inline constexpr const char* released_columns =
    "UPDATE jobs SET state = CASE cancel_requested WHEN 1 THEN 'cancelled' ELSE 'queued' END,"
    " ended_at = CASE cancel_requested WHEN 1 THEN max(?1, started_at) END, cancel_requested = 0,"
    " revision = revision + 1, moved_at = ?1,"
    " expires_at = coalesce(expires_at, CASE cancel_requested WHEN 1 THEN ?1 + 1000 * expires_in_s END), moved_for = ";

}  // namespace queue
