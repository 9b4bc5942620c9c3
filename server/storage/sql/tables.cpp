#include "server/storage/sql/tables.h"

namespace storage::sql {

const char* const jobs_tables =
#include "server/storage/sql/jobs_tables.sql"
    ;

const char* const deliveries_tables =
#include "server/storage/sql/deliveries_tables.sql"
    ;

const char* const objects_tables =
#include "server/storage/sql/objects_tables.sql"
    ;

}  // namespace storage::sql
