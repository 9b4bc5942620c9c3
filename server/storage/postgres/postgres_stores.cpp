#include "server/storage/postgres/postgres_stores.h"

#include "server/storage/postgres/postgres_cluster_store.h"
#include "server/storage/postgres/postgres_schema.h"
#include "server/storage/postgres/postgres_task_store.h"
#include "server/storage/postgres/postgres_transactions.h"
#include "server/storage/postgres/postgres_wakeups.h"

namespace storage::postgres {

struct PostgresStores::Parts {
  Parts(const std::string& dsn, const PostgresSettings& settings)
      : transactions((settings.for_copy ? prepare_copy(dsn) : prepare_schema(dsn),
                      std::make_shared<PostgresTransactions>(dsn, settings.connections))),
        tasks(make_task_store(*transactions, settings.node, settings.build)),
        wakeups(dsn) {}
  std::shared_ptr<sql::Transactions> transactions;
  queue::JobStores jobs{*transactions};
  queue::DeliveryStore deliveries{transactions};
  std::unique_ptr<queue::TaskStore> tasks;
  DatabaseClock clock{*transactions};
  std::unique_ptr<queue::ClusterStore> cluster = make_cluster_store(*transactions, clock);
  PostgresWakeups wakeups;
};

void check_database(const std::string& dsn) { check_schema(dsn); }

PostgresStores::PostgresStores(const std::string& dsn, const PostgresSettings& settings)
    : parts_(std::make_unique<Parts>(dsn, settings)) {}
PostgresStores::~PostgresStores() = default;

queue::Stores PostgresStores::all() const { return parts_->jobs.all(); }
queue::DeliveryStore& PostgresStores::deliveries() const { return parts_->deliveries; }
queue::ClusterStore& PostgresStores::cluster() const { return *parts_->cluster; }
queue::Wakeups& PostgresStores::wakeups() const { return parts_->wakeups; }
queue::Clock PostgresStores::clock() const {
  return [&clock = parts_->clock] { return clock.now(); };
}
sql::Transactions& PostgresStores::transactions() const { return *parts_->transactions; }
queue::TaskStore& PostgresStores::tasks() const { return *parts_->tasks; }

}  // namespace storage::postgres
