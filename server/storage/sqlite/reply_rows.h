#pragma once
/// Conversion of replies under idempotency keys to rows and back. Private to this directory.

#include <cstdint>
#include <optional>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

/// Replaces an expired one.
void insert_reply(Database& database, const queue::KeptReply& kept);
std::optional<queue::KeptReply> read_reply(Database& database, const queue::ReplyKey& key, std::int64_t now);

}  // namespace storage::sqlite
