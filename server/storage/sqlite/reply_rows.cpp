#include "server/storage/sqlite/reply_rows.h"

namespace storage::sqlite {

void insert_reply(Database& database, const queue::KeptReply& kept) {
  database.change(
      "INSERT OR REPLACE INTO replies (owner, route, key, request_sha256, status, location, body, expires_at)"
      " VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      kept.key.owner, kept.key.route, kept.key.key, kept.request_sha256, std::int64_t{kept.reply.status},
      kept.reply.location, kept.reply.body, kept.expires_at);
}

std::optional<queue::KeptReply> read_reply(Database& database, const queue::ReplyKey& key, std::int64_t now) {
  Query row = database.query(
      "SELECT request_sha256, status, location, body, expires_at FROM replies"
      " WHERE owner = ? AND route = ? AND key = ? AND expires_at > ?",
      key.owner, key.route, key.key, now);
  if (!row.row()) return std::nullopt;
  const queue::FirstReply reply{static_cast<int>(row.integer(1)), row.text(2), row.text(3)};
  return queue::KeptReply{key, row.text(0), reply, row.integer(4)};
}

}  // namespace storage::sqlite
