#pragma once
/// Batches to rows and back. Private to this directory.

#include <optional>
#include <string>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

void insert_batch(Database& database, const Batch& batch);
std::optional<BatchState> read_batch(Database& database, const std::string& id);

}  // namespace queue::sqlite
