#pragma once
/// Copies of a data directory's databases as they were at one moment each, whoever uses them.

#include <string>

namespace queue {

/// DIRECTORY's whittle.db, then webhooks.db where there is one: who wants to hear of a job is stored before the job, so
/// each job that is copied has its subscriptions. Neither is synced. Throws StoreFailure.
void copy_databases(const std::string& directory, const std::string& into);

}  // namespace queue
