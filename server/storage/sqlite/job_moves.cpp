#include "server/storage/sqlite/job_moves.h"

#include <cassert>

#include "server/storage/sqlite/job_rows.h"

namespace queue::sqlite {

CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now) {
  if (database.change("UPDATE jobs SET state = 'cancelled', ended_at = ?1, not_before = NULL,"
                      " expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s), revision = revision + 1"
                      " WHERE id = ?2 AND state = 'queued'",
                      now, id) == 1) {
    return CancelOutcome::cancelled;
  }
  if (database.change("UPDATE jobs SET revision = revision + (cancel_requested = 0), cancel_requested = 1"
                      " WHERE id = ? AND state = 'running'",
                      id) == 1) {
    return CancelOutcome::cancelling;
  }
  return database.query("SELECT 1 FROM jobs WHERE id = ?", id).row() ? CancelOutcome::already_ended
                                                                     : CancelOutcome::unknown;
}

RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now) {
  const std::optional<Job> job = read_job(database, id);
  if (!job) return RetryOutcome::unknown;
  if (!ended(job->state)) return RetryOutcome::not_ended;
  if (job->state == JobState::succeeded) return RetryOutcome::succeeded;
  if (job->expired) return RetryOutcome::expired;
  assert(may_move(job->state, JobState::queued));
  database.change("DELETE FROM problem_errors WHERE job_id = ?", id);
  database.change(
      "UPDATE jobs SET state = 'queued', attempt = 0, started_at = NULL, ended_at = NULL, expires_at = NULL,"
      " problem_code = NULL, problem_detail = NULL, deadline = iif(deadline <= ?1, NULL, deadline),"
      " not_before = iif(run_after > ?1, run_after, NULL), rank = ?2, revision = revision + 1 WHERE id = ?3",
      now, rank_of(now, job->run_after, job->priority), id);
  return RetryOutcome::queued;
}

}  // namespace queue::sqlite
