#pragma once
/// Copies everything that a daemon has stored from one kind of storage to another.

#include <functional>
#include <string>

#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"
#include "server/storage/sql/sql_database.h"

namespace storage::copy {

/// The stores of a daemon. The databases have sql::jobs_tables and sql::deliveries_tables.
struct End {
  sql::Transactions& jobs;
  sql::Transactions& deliveries;
  queue::ArtifactStore& artifacts;
  queue::AssetStore& assets;
};

/// One line about the progress, for people.
using Report = std::function<void(const std::string& line)>;

/// Copies jobs, batches, documents, replies under idempotency keys, webhook deliveries, artifacts and assets, and
/// compares all of them afterwards: rows by a hash over each table, bytes with their names. Continues an interrupted
/// copy: rows after the last one that was copied, and the bytes that are missing. Assets count as used now, and the
/// shares of owners begin anew.
///
/// Nothing else may change either end meanwhile. Throws queue::StoreFailure: a missing or damaged artifact or asset, or
/// `to` has rows that are not those of `from`.
void copy_all(const End& from, const End& to, const Report& report);

}  // namespace storage::copy
