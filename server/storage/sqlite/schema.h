#pragma once
/// The tables, and how an older file becomes a current one. Private to this directory.

#include <cstdint>
#include <string>

#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

inline constexpr std::int64_t schema_version = 6;

/// Sets the writing connection up (WAL, synchronous = FULL) and brings the file to `version`, each step in a
/// transaction: to an older one only where a test makes an old file. Refuses, as StoreFailure, a file that a newer
/// program wrote: it would not be understood.
void prepare_file(Database& database, const std::string& path, std::int64_t version = schema_version);

}  // namespace queue::sqlite
