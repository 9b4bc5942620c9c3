#pragma once
/// The tables, and how an older file becomes a current one. Private to this folder.

#include <string>

#include "server/storage/sqlite/database.h"

namespace jobs::sqlite {

/// Sets the writing connection up (WAL, synchronous = FULL) and brings the file to the current version, each step in a
/// transaction. Refuses, as StoreFailure, a file that a newer program wrote: it would not be understood.
void prepare_file(Database& database, const std::string& path);

}  // namespace jobs::sqlite
