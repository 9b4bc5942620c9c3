#include "server/storage/sqlite/job_moves.h"

#include <cassert>

#include "server/storage/sqlite/job_rows.h"

namespace storage::sqlite {

queue::Claim claim_job(Database& database, const std::string& id, const queue::ClaimTerms& terms, std::int64_t now) {
  database.change(
      "UPDATE jobs SET state = 'running', started_at = ?, attempt = attempt + 1, fence = fence + 1, boot_id = ?,"
      " lease_until = ?, revision = revision + 1 WHERE id = ?",
      now, terms.boot_id, terms.lease_until, id);
  Query fence = database.query("SELECT fence FROM jobs WHERE id = ?", id);
  fence.row();
  return {read_job(database, id).value(), {}, fence.integer(0)};
}

std::optional<queue::Claim> claim_if_alone(Database& database, const std::string& id, const queue::ClaimTerms& terms,
                                           std::int64_t now) {
  {
    Query waiting = database.query(
        "SELECT id, deadline FROM jobs INDEXED BY jobs_waiting WHERE state = 'queued' AND not_before IS NULL LIMIT 2");
    if (!waiting.row() || waiting.text(0) != id || (!waiting.is_null(1) && waiting.integer(1) <= now)) return {};
    if (waiting.row()) return {};
  }
  queue::Claim claim = claim_job(database, id, terms, now);
  claim.is_last = true;
  return claim;
}

queue::CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now) {
  if (database.change("UPDATE jobs SET state = 'cancelled', ended_at = ?1, not_before = NULL,"
                      " expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s), revision = revision + 1"
                      " WHERE id = ?2 AND state = 'queued'",
                      now, id) == 1) {
    return queue::CancelOutcome::cancelled;
  }
  if (database.change("UPDATE jobs SET revision = revision + (cancel_requested = 0), cancel_requested = 1"
                      " WHERE id = ? AND state = 'running'",
                      id) == 1) {
    return queue::CancelOutcome::cancelling;
  }
  return database.query("SELECT 1 FROM jobs WHERE id = ?", id).row() ? queue::CancelOutcome::already_ended
                                                                     : queue::CancelOutcome::unknown;
}

queue::RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now) {
  const std::optional<queue::Job> job = read_job(database, id);
  if (!job) return queue::RetryOutcome::unknown;
  if (!queue::ended(job->state)) return queue::RetryOutcome::not_ended;
  if (job->state == queue::JobState::succeeded) return queue::RetryOutcome::succeeded;
  if (job->expired) return queue::RetryOutcome::expired;
  assert(queue::may_move(job->state, queue::JobState::queued));
  database.change("DELETE FROM problem_errors WHERE job_id = ?", id);
  database.change(
      "UPDATE jobs SET state = 'queued', attempt = 0, started_at = NULL, ended_at = NULL, expires_at = NULL,"
      " problem_code = NULL, problem_detail = NULL, deadline = iif(deadline <= ?1, NULL, deadline),"
      " not_before = iif(run_after > ?1, run_after, NULL), rank = ?2, revision = revision + 1 WHERE id = ?3",
      now, queue::rank_of(now, job->run_after, job->priority), id);
  return queue::RetryOutcome::queued;
}

}  // namespace storage::sqlite
