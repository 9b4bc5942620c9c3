#pragma once
/// Copies of the databases of a data directory that may be in use, each of one moment.

#include <string>

namespace storage::sqlite {

/// Copies whittle.db, then webhooks.db where there is one: a subscription is stored before its job, so each copied job
/// has its subscriptions. Neither copy is synced. Throws StoreFailure.
void copy_databases(const std::string& directory, const std::string& into);

}  // namespace storage::sqlite
