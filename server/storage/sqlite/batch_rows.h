#pragma once
/// Batches to rows and back. Private to this folder.

#include <optional>
#include <string>

#include "server/jobs/job_store.h"
#include "server/storage/sqlite/database.h"

namespace jobs::sqlite {

void insert_batch(Database& database, const Batch& batch);
std::optional<BatchState> read_batch(Database& database, const std::string& id);

}  // namespace jobs::sqlite
