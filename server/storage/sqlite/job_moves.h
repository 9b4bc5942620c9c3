#pragma once
/// Moves of a job that its owner asks for, inside a transaction: of one job or of all of a batch. Private to this
/// folder.

#include <cstdint>
#include <string>

#include "server/jobs/job_store.h"
#include "server/storage/sqlite/database.h"

namespace jobs::sqlite {

CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now);
RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now);

}  // namespace jobs::sqlite
