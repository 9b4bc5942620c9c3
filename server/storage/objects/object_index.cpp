#include "server/storage/objects/object_index.h"

#include <algorithm>

#include "server/storage/files/durable_file.h"

namespace storage::objects {
namespace {

using sql::Database;

bool use_object(Database& database, const std::string& kind, const std::string& sha256, std::int64_t now) {
  return database.change("UPDATE objects SET used_at = max(used_at, ?1) WHERE kind = ?2 AND sha256 = ?3", now, kind,
                         sha256) > 0;
}

bool insert_object(Database& database, const std::string& kind, const std::string& sha256, std::int64_t bytes,
                   std::int64_t now) {
  return database.change(
             "INSERT INTO objects (kind, sha256, bytes, used_at, finished) VALUES (?, ?, ?, ?, 0)"
             " ON CONFLICT (kind, sha256) DO NOTHING",
             kind, sha256, bytes, now) > 0;
}

/// False where the limit would be exceeded.
bool count_bytes(Database& database, const std::string& kind, std::int64_t bytes, std::int64_t bytes_max) {
  if (kind != "asset") return true;
  return database.change("UPDATE object_totals SET bytes = bytes + ?1 WHERE kind = ?2 AND bytes + ?1 <= ?3", bytes,
                         kind, bytes_max) > 0;
}

std::string not_named_in(const char* table) {
  return std::string(" AND NOT EXISTS (SELECT 1 FROM ") + table + " WHERE " + table + ".sha256 = objects.sha256)";
}

std::int64_t clamped(std::uint64_t bytes) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(bytes, INT64_MAX));
}

}  // namespace

ObjectIndex::ObjectIndex(sql::Transactions& transactions, Kind kind)
    : transactions_(transactions),
      kind_(kind == Kind::asset ? "asset" : "artifact"),
      not_named_(kind == Kind::asset ? not_named_in("job_assets") + not_named_in("scene_assets")
                                     : not_named_in("artifacts")) {}

bool ObjectIndex::begin(const std::string& sha256, std::uint64_t bytes, std::int64_t now, std::uint64_t bytes_max) {
  return transactions_.write([&](Database& database) {
    if (use_object(database, kind_, sha256, now)) return true;
    if (!insert_object(database, kind_, sha256, clamped(bytes), now)) return use_object(database, kind_, sha256, now);
    if (count_bytes(database, kind_, clamped(bytes), clamped(bytes_max))) return true;
    database.change("DELETE FROM objects WHERE kind = ? AND sha256 = ?", kind_, sha256);
    return false;
  });
}

void ObjectIndex::finish(const std::string& sha256) {
  transactions_.change("UPDATE objects SET finished = 1 WHERE kind = ? AND sha256 = ?", kind_, sha256);
}

void ObjectIndex::adopt(const std::vector<ObjectStore::Object>& objects, std::int64_t now) {
  transactions_.write([&](Database& database) {
    for (const auto& [sha256, bytes] : objects) {
      if (insert_object(database, kind_, sha256, clamped(bytes), now))
        count_bytes(database, kind_, clamped(bytes), INT64_MAX);
    }
    return true;
  });
}

bool ObjectIndex::use(const std::string& sha256, std::int64_t now) {
  return transactions_.change(
             "UPDATE objects SET used_at = max(used_at, ?1) WHERE kind = ?2 AND sha256 = ?3 AND finished = 1", now,
             kind_, sha256) > 0;
}

std::vector<std::string> ObjectIndex::unused_since(int part, std::int64_t then) {
  const std::string first = files::name_of_part(part);
  return transactions_.texts(
      "SELECT sha256 FROM objects WHERE kind = ?1 AND sha256 >= ?2 AND sha256 < ?3 AND used_at < ?4" + not_named_,
      kind_, first, first + "g", then);
}

bool ObjectIndex::remove_unused_since(const std::string& sha256, std::int64_t then,
                                      const std::function<void()>& remove_bytes) {
  const int unused =
      transactions_.change("UPDATE objects SET finished = 0 WHERE kind = ? AND sha256 = ? AND used_at < ?" + not_named_,
                           kind_, sha256, then);
  if (unused == 0) return false;
  return transactions_.write([&](Database& database) {
    std::int64_t size = 0;
    {
      sql::Query row =
          database.query("SELECT bytes FROM objects WHERE kind = ? AND sha256 = ? AND used_at < ? AND finished = 0" +
                             not_named_ + database.locking(),
                         kind_, sha256, then);
      if (!row.row()) return false;
      size = row.integer(0);
    }
    remove_bytes();
    database.change("DELETE FROM objects WHERE kind = ? AND sha256 = ?", kind_, sha256);
    count_bytes(database, kind_, -size, INT64_MAX);
    return true;
  });
}

std::uint64_t ObjectIndex::bytes() {
  return transactions_.read([&](Database& database) {
    sql::Query total = database.query("SELECT bytes FROM object_totals WHERE kind = ?", kind_);
    return total.row() ? static_cast<std::uint64_t>(total.integer(0)) : 0;
  });
}

}  // namespace storage::objects
