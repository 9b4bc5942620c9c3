#pragma once
/// The connections of one node to PostgreSQL. Private to this directory.

#include <memory>
#include <string>

#include "server/storage/sql/sql_database.h"

namespace storage::postgres {

/// Up to `connections`, which are opened when they are needed, each used by one caller at a time. A lost one is
/// replaced.
std::unique_ptr<sql::Transactions> make_transactions(const std::string& dsn, int connections);

}  // namespace storage::postgres
