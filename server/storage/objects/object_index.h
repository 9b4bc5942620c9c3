#pragma once
/// The content of a shared object store as rows of the database, so that no node deletes bytes that another one is
/// about to name in a job.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/storage/objects/object_store.h"
#include "server/storage/sql/sql_database.h"

namespace storage::objects {

/// One kind of objects. A writer calls `begin`, stores the bytes, then calls `finish` and names them in a job. Removal
/// locks the row, and only where the last use is old enough; so `begin` either comes before, and prevents it, or waits
/// until the bytes are gone, and they are stored again. A removal that ends in the middle leaves a row that is not
/// finished, which `use` does not find, and which is removed again. Thread-safe. Throws StoreFailure. Times are
/// milliseconds since 1970 UTC.
class ObjectIndex {
 public:
  enum class Kind { artifact, asset };
  /// `transactions` must outlive this; its database has sql::jobs_tables and sql::objects_tables.
  ObjectIndex(sql::Transactions& transactions, Kind kind);

  /// Marks an object as used now, with a new row where there is none. False, without an effect, where all objects of
  /// the kind would have more than `bytes_max`; those of artifacts are not counted.
  bool begin(const std::string& sha256, std::uint64_t bytes, std::int64_t now, std::uint64_t bytes_max = INT64_MAX);
  void finish(const std::string& sha256);

  /// Adds rows, used now, for the objects that have none.
  void adopt(const std::vector<ObjectStore::Object>& objects, std::int64_t now);

  bool use(const std::string& sha256, std::int64_t now);  ///< false where the bytes were not stored

  /// The objects of one part (0 <= `part` < queue::AssetStore::parts) that no job names and whose last use was before
  /// `then`.
  std::vector<std::string> unused_since(int part, std::int64_t then);

  /// Calls `remove_bytes` unless the object was used at or after `then`, or a job names it; false where it stays or
  /// there is no row.
  bool remove_unused_since(const std::string& sha256, std::int64_t then, const std::function<void()>& remove_bytes);

  std::uint64_t bytes();  ///< size of all assets

 private:
  sql::Transactions& transactions_;
  std::string kind_;
  std::string not_named_;  ///< the condition that no job names a row of `objects`
};

}  // namespace storage::objects
