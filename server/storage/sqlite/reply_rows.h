#pragma once
/// Replies under idempotency keys to rows and back. Private to this folder.

#include <cstdint>
#include <optional>

#include "server/jobs/job_store.h"
#include "server/storage/sqlite/database.h"

namespace jobs::sqlite {

/// In place of one that has expired.
void insert_reply(Database& database, const KeptReply& kept);
std::optional<KeptReply> read_reply(Database& database, const ReplyKey& key, std::int64_t now);

}  // namespace jobs::sqlite
