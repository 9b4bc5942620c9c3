#pragma once
/// The tasks in PostgreSQL. Private to this directory.

#include <memory>
#include <string>

#include "server/queue/task_store.h"
#include "server/storage/sql/sql_database.h"

namespace storage::postgres {

/// Tables that a crash of the server empties, so that their content is written once and not twice.
extern const char* const tasks_tables;

/// `node` names this node uniquely, `build` its program. `transactions` must outlive the result.
std::unique_ptr<queue::TaskStore> make_task_store(sql::Transactions& transactions, const std::string& node,
                                                  const std::string& build);

}  // namespace storage::postgres
