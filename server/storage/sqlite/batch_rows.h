#pragma once
/// Conversion of batches to rows and back. Private to this directory.

#include <optional>
#include <string>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

void insert_batch(Database& database, const queue::Batch& batch);
std::optional<queue::BatchState> read_batch(Database& database, const std::string& id);

}  // namespace storage::sqlite
