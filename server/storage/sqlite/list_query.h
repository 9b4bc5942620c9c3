#pragma once
/// Pages of jobs, newest first, over 100,000 jobs in milliseconds. Private to this directory.

#include <string>
#include <vector>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

/// Ids of at most `limit` matching jobs older than `cursor` (empty: from the newest), newest first.
std::vector<std::string> list_ids(Database& database, const queue::JobFilter& filter, const std::string& cursor,
                                  int limit);

std::int64_t count_jobs(Database& database, queue::JobState state);

}  // namespace storage::sqlite
