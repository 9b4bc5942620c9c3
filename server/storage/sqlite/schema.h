#pragma once
/// The tables of jobs. Private to this directory.

#include <cstdint>
#include <string>

#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

inline constexpr std::int64_t jobs_schema_version = 8;

/// Sets up the connection (WAL, synchronous = FULL) and creates the tables in an empty file.
void prepare_jobs(Database& database, const std::string& path);

/// The same for any schema. Throws StoreFailure for a file with another version.
void prepare(Database& database, const std::string& path, std::int64_t version, const std::string& schema);

}  // namespace storage::sqlite
