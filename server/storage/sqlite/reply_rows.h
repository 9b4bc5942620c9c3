#pragma once
/// Replies under idempotency keys to rows and back. Private to this directory.

#include <cstdint>
#include <optional>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

/// In place of one that has expired.
void insert_reply(Database& database, const KeptReply& kept);
std::optional<KeptReply> read_reply(Database& database, const ReplyKey& key, std::int64_t now);

}  // namespace queue::sqlite
