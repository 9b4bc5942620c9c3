#pragma once
/// Copies of a data folder's databases as they were at one moment each, whoever uses them.

#include <string>

namespace jobs {

/// FOLDER's whittle.db and, where there is one, webhooks.db, which is copied first: of a job that came in between none
/// is told rather than one of which nobody knows. Not synced. Throws StoreFailure.
void copy_databases(const std::string& folder, const std::string& into);

}  // namespace jobs
