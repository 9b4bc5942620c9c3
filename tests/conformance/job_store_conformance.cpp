#include "tests/conformance/job_store_conformance.h"

#include "server/storage/postgres/postgres_stores.h"
#include "tests/conformance/test_store.h"
#include "tests/support/postgres_server.h"

namespace {

const storage::sqlite::SqliteSettings no_sync{.synchronous = false};

class Sqlite final : public StoreUnderTest {
 public:
  StoreCalls& store() override { return *store_; }
  void reopen() override {
    store_.reset();
    store_ = std::make_unique<TestStore>(directory_.path(), no_sync);
  }

 private:
  TemporaryDirectory directory_;
  std::unique_ptr<TestStore> store_ = std::make_unique<TestStore>(directory_.path(), no_sync);
};

/// A database with the schema: a copy takes half the time of a migration, which has tests of its own.
std::string migrated_database() {
  static const std::string migrated = [] {
    const std::string uri = PostgresServer::shared().new_database();
    const storage::postgres::PostgresStores stores(uri);
    return uri;
  }();
  return PostgresServer::shared().copy_database(migrated);
}

class Postgres final : public StoreUnderTest {
 public:
  StoreCalls& store() override { return node_->calls; }
  StoreCalls& other_node() override { return (other_ ? *other_ : other_.emplace(uri_)).calls; }
  void reopen() override { node_.emplace(uri_); }
  [[nodiscard]] bool is_shared() const override { return true; }

 private:
  struct Node {
    explicit Node(const std::string& uri) : stores(uri) {}
    storage::postgres::PostgresStores stores;
    StoreCalls calls{stores.all()};
  };
  const std::string uri_ = migrated_database();
  std::optional<Node> node_{uri_}, other_;
};

}  // namespace

std::vector<StoreKind> store_kinds() {
  return {{"Sqlite", [] { return std::make_unique<Sqlite>(); }},
          {"Postgres", [] { return std::make_unique<Postgres>(); }}};
}

queue::Job JobStoreConformance::new_job() {
  queue::Job job = job_named(numbered_id(++submitted_));
  job.created_at = now;
  return job;
}

std::string JobStoreConformance::submit(const std::function<void(queue::Job&)>& change, const std::string& document) {
  queue::Job job = new_job();
  if (change) change(job);
  store().submit(job, document);
  return job.id;
}

queue::Claim JobStoreConformance::claim(bool alone) {
  std::optional<queue::Claim> claim = store().claim("boot", now, lease_end, alone);
  if (!claim) throw std::runtime_error("nothing to claim");
  return *std::move(claim);
}

queue::Job JobStoreConformance::succeed_next(const std::vector<queue::Artifact>& artifacts) {
  const queue::Claim next = claim();
  EXPECT_TRUE(store().succeed(next.job.id, next.fence, now, "{}", artifacts));
  return next.job;
}

queue::Job JobStoreConformance::fail_next() {
  const queue::Claim next = claim();
  EXPECT_TRUE(store().fail(next.job.id, next.fence, now, {"internal", "x", {}}));
  return next.job;
}

queue::Job JobStoreConformance::find(const std::string& id) {
  std::optional<queue::Job> job = store().find(id);
  if (!job) throw std::runtime_error("no job " + id);
  return *std::move(job);
}

std::vector<std::string> JobStoreConformance::list(const queue::JobFilter& filter, int limit) {
  std::vector<std::string> ids;
  std::string cursor;
  do {
    const queue::JobPage page = store().list(filter, cursor, limit);
    EXPECT_LE(page.items.size(), static_cast<std::size_t>(limit));
    for (const queue::Job& job : page.items) ids.push_back(job.id);
    cursor = page.next_cursor;
  } while (!cursor.empty());
  return ids;
}

JobStoreConformance::Placed JobStoreConformance::place(queue::JobState state) {
  using enum queue::JobState;
  Placed placed{submit(), 0};
  if (state == queued) return placed;
  if (state == cancelled) {
    store().cancel(placed.id, now);
    return placed;
  }
  const queue::Claim claimed = claim();
  EXPECT_EQ(claimed.job.id, placed.id) << "place() needs an otherwise empty queue";
  placed.fence = claimed.fence;
  if (state == succeeded) store().succeed(placed.id, placed.fence, now, "{}", {});
  if (state == failed) store().fail(placed.id, placed.fence, now, {"internal", "A test failed it.", {}});
  return placed;
}
