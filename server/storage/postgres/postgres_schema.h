#pragma once
/// The tables in PostgreSQL. Private to this directory.

#include <string>

namespace storage::postgres {

/// Versions grow by one, and each is made so that a program of the version before works with it: new tables, new
/// columns with a default, other bodies of functions. So nodes are updated one after the other.
inline constexpr int schema_version = 2;

/// Creates the tables in an empty database, or brings them to `schema_version`, under an advisory lock: of nodes that
/// start at the same time one does it. Throws StoreFailure if the database cannot be reached or has a version that this
/// program does not support.
void prepare_schema(const std::string& dsn);

/// Checks the version without changing anything. Throws StoreFailure like prepare_schema.
void check_schema(const std::string& dsn);

/// Prepares the schema for a copy of other data: the database must be empty or contain an unfinished copy. Nothing else
/// opens it until finish_copy.
void prepare_copy(const std::string& dsn);
void finish_copy(const std::string& dsn);

}  // namespace storage::postgres
