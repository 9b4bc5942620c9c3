#pragma once
/// Moves of a job inside a transaction: those by its owner, of one job or of a batch, and the release. Private to this
/// directory.

#include <cstdint>
#include <string>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

/// Without the document. Precondition: the job is queued.
queue::Claim claim_job(Database& database, const std::string& id, const queue::ClaimTerms& terms, std::int64_t now);
/// Claims a queued job that may run if no other job waits.
std::optional<queue::Claim> claim_if_alone(Database& database, const std::string& id, const queue::ClaimTerms& terms,
                                           std::int64_t now);

queue::CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now);
/// An UPDATE of a running job that returns to queued, or to cancelled where that was requested; ?1 is now. The attempt
/// and the condition follow.
inline constexpr const char* released_columns =
    "UPDATE jobs SET state = iif(cancel_requested, 'cancelled', 'queued'),"
    " ended_at = iif(cancel_requested, ?1, NULL), cancel_requested = 0, revision = revision + 1,"
    " expires_at = coalesce(expires_at, iif(cancel_requested, ?1 + 1000 * expires_in_s, NULL)),";

queue::RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now);

}  // namespace storage::sqlite
