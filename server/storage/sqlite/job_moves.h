#pragma once
/// Moves of a job inside a transaction: those that its owner asks for, of one job or of all of a batch, and the way
/// back into the queue. Private to this directory.

#include <cstdint>
#include <string>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now);
/// The columns of a running job that goes back to the queue, or is cancelled where that was asked for; ?1 is now. The
/// attempt and the rows follow.
inline constexpr const char* given_back =
    "UPDATE jobs SET state = iif(cancel_requested, 'cancelled', 'queued'),"
    " ended_at = iif(cancel_requested, ?1, NULL), cancel_requested = 0, revision = revision + 1,"
    " expires_at = coalesce(expires_at, iif(cancel_requested, ?1 + 1000 * expires_in_s, NULL)),";

RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now);

}  // namespace queue::sqlite
