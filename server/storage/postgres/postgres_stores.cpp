#include "server/storage/postgres/postgres_stores.h"

#include "server/storage/postgres/postgres_schema.h"
#include "server/storage/postgres/postgres_transactions.h"
#include "server/storage/postgres/postgres_wakeups.h"

namespace storage::postgres {

void check_database(const std::string& dsn) { check_schema(dsn); }

PostgresStores::PostgresStores(const std::string& dsn, const PostgresSettings& settings)
    : transactions_(
          (settings.for_copy ? prepare_copy(dsn) : prepare_schema(dsn), make_transactions(dsn, settings.connections))),
      jobs_(std::make_unique<queue::JobStores>(*transactions_)),
      deliveries_(std::make_unique<queue::DeliveryStore>(*transactions_)),
      tasks_(std::make_unique<queue::TaskStore>(*transactions_, settings.node, settings.build)),
      cluster_(std::make_unique<queue::ClusterStore>(*transactions_)),
      wakeups_(make_wakeups(dsn)) {}

}  // namespace storage::postgres
