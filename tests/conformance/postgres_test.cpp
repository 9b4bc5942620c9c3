/// The store that several processes share: two of them on one database, and failures of the connection.

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

#include "server/storage/postgres/postgres_stores.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"
#include "tests/support/postgres_server.h"
#include "tests/support/threads.h"

using namespace queue;
using storage::postgres::PostgresStores;

namespace {

/// Passes one connection at a time from a unix socket to that of the server, and can cut the next commit.
class Proxy {
 public:
  enum class Cut { nothing, request, answer };

  explicit Proxy(std::string server_directory) : server_(std::move(server_directory)) {
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_un address = address_in(directory_.path());
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 16), 0);
    acceptor_ = std::thread([this] { accept_all(); });
  }
  ~Proxy() {
    shutdown(listener_, SHUT_RDWR);
    acceptor_.join();
    for (std::thread& thread : threads_) thread.join();
    close(listener_);
  }
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  [[nodiscard]] const std::string& directory() const { return directory_.path(); }
  std::atomic<Cut> next_commit{Cut::nothing};
  std::atomic<int> cuts{0};

 private:
  static sockaddr_un address_in(const std::string& directory) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = directory + "/.s.PGSQL.5432";
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    return address;
  }

  void accept_all() {
    for (int client = 0; (client = accept(listener_, nullptr, nullptr)) >= 0;) {
      const int server = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      const sockaddr_un address = address_in(server_);
      EXPECT_EQ(connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
      threads_.emplace_back([this, client, server] { pass(client, server); });
    }
  }

  void pass(int client, int server) {
    std::thread answers([&] { copy(server, client); });
    std::array<char, 65536> bytes;
    for (ssize_t got = 0; (got = recv(client, bytes.data(), bytes.size(), 0)) > 0;) {
      const bool commits =
          std::string_view(bytes.data(), static_cast<std::size_t>(got)).find("COMMIT") != std::string::npos;
      const Cut cut = commits ? next_commit.exchange(Cut::nothing) : Cut::nothing;
      if (cut != Cut::nothing) {
        ++cuts;
        shutdown(client, SHUT_RDWR);  // no answer arrives any more
      }
      if (cut == Cut::request) break;
      send(server, bytes.data(), static_cast<std::size_t>(got), MSG_NOSIGNAL);
    }
    shutdown(server, SHUT_WR);  // the server ends the session after what it has received
    answers.join();
    close(client);
    close(server);
  }

  static void copy(int from, int to) {
    std::array<char, 65536> bytes;
    for (ssize_t got = 0; (got = recv(from, bytes.data(), bytes.size(), 0)) > 0;)
      send(to, bytes.data(), static_cast<std::size_t>(got), MSG_NOSIGNAL);
    shutdown(to, SHUT_RDWR);
  }

  const std::string server_;
  TemporaryDirectory directory_;
  int listener_ = -1;
  std::thread acceptor_;
  std::vector<std::thread> threads_;
};

class PostgresStoresTest : public PostgresTest {};

}  // namespace

TEST_F(PostgresStoresTest, CountsStayExactWhileTheyAreAddedUp) {
  PostgresStores stores(uri);
  StoreCalls calls(stores.all());
  for (int i = 0; i < 150; ++i) {
    calls.submit(job_named(numbered_id(i)), "{}");
    if (i % 3 == 0) calls.cancel(numbered_id(i), 2);
    ASSERT_EQ(calls.count(JobState::queued), i + 1 - (i / 3 + 1)) << i;
    ASSERT_EQ(calls.owner_usage("").queued_jobs, calls.count(JobState::queued));
  }
  EXPECT_EQ(server.sql(uri, "SELECT sum(amount) FROM current_counts WHERE what = 'cancelled'"), "50");
  EXPECT_NE(server.sql(uri, "SELECT count(*) FROM counts"), "0") << "they were added up meanwhile";
}

TEST_F(PostgresStoresTest, NodesThatStartAtOnceCreateTheTablesOnce) {
  in_threads(4, [&](int node) {
    PostgresStores stores(uri);
    StoreCalls(stores.all()).submit(job_named(numbered_id(node)), "{}");
  });
  EXPECT_EQ(server.sql(uri, "SELECT count(*) FROM whittle_schema"), "1");
  EXPECT_EQ(server.sql(uri, "SELECT count(*) FROM jobs"), "4");
}

TEST_F(PostgresStoresTest, NodesThatStartAtOnceMigrateAnOlderSchemaOnce) {
  {
    PostgresStores older(uri);
    StoreCalls(older.all()).submit(job_named(numbered_id(1)), "{}");
    older.cluster().number_events();
  }
  server.sql(uri,
             "UPDATE whittle_schema SET version = 1;"
             " CREATE OR REPLACE FUNCTION number_events() RETURNS BIGINT LANGUAGE sql AS 'SELECT 0::bigint';"
             " CREATE TABLE migrations (version INTEGER);"
             " CREATE FUNCTION note() RETURNS TRIGGER LANGUAGE plpgsql AS"
             " 'BEGIN INSERT INTO migrations VALUES (new.version); RETURN NULL; END';"
             " CREATE TRIGGER note AFTER UPDATE ON whittle_schema FOR EACH ROW EXECUTE FUNCTION note()");
  in_threads(4, [&](int node) {
    PostgresStores stores(uri);
    StoreCalls(stores.all()).submit(job_named(numbered_id(2 + node)), "{}");
  });
  EXPECT_EQ(server.sql(uri, "SELECT string_agg(version::text, ' ') FROM migrations"), "2");
  EXPECT_EQ(server.sql(uri, "SELECT version FROM whittle_schema"), "2");
  PostgresStores stores(uri);
  EXPECT_EQ(stores.cluster().number_events(), 4) << "the function of this version";
  EXPECT_EQ(StoreCalls(stores.all()).find(numbered_id(1))->state, JobState::queued);
}

TEST_F(PostgresStoresTest, StartsBesideTheNextVersionAndRefusesLaterOnes) {
  { const PostgresStores stores(uri); }
  server.sql(uri, "UPDATE whittle_schema SET version = version + 1");
  EXPECT_NO_THROW(PostgresStores{uri});
  server.sql(uri, "UPDATE whittle_schema SET version = version + 1");
  EXPECT_THROW(PostgresStores{uri}, StoreFailure);
}

TEST_F(PostgresStoresTest, RefusesTheDatabaseOfAnotherProgram) {
  server.sql(uri, "CREATE TABLE jobs (id INTEGER)");
  EXPECT_THROW(PostgresStores{uri}, StoreFailure);
  EXPECT_EQ(server.sql(uri, "SELECT count(*) FROM pg_class WHERE relname = 'documents'"), "0");
}

TEST_F(PostgresStoresTest, ReplacesConnectionsThatTheServerEnds) {
  PostgresStores stores(uri);
  StoreCalls calls(stores.all());
  calls.submit(job_named(numbered_id(1)), "{}");
  const std::string end =
      "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid()"
      " AND datname = current_database()";
  server.sql(uri, end);
  EXPECT_TRUE(calls.find(numbered_id(1)));
  server.sql(uri, end);
  EXPECT_NO_THROW(calls.submit(job_named(numbered_id(2)), "{}"));
  EXPECT_EQ(calls.count(JobState::queued), 2);
}

TEST_F(PostgresStoresTest, ReportsAServerThatIsDownAndContinuesWithTheNextOne) {
  PostgresServer own;
  const std::string own_uri = own.new_database();
  PostgresStores stores(own_uri);
  StoreCalls calls(stores.all());
  calls.submit(job_named(numbered_id(1)), "{}");
  own.stop();
  const auto submit = [&] { calls.submit(job_named(numbered_id(2)), "{}"); };
  EXPECT_EQ(failure_of(submit).kind, StoreFailure::Kind::unavailable);
  EXPECT_THROW(calls.find(numbered_id(1)), StoreFailure);
  own.start();
  EXPECT_TRUE(eventually([&] { return !failure_of(submit).kind; }));
  EXPECT_EQ(calls.count(JobState::queued), 2);
}

TEST_F(PostgresStoresTest, LearnsTheOutcomeOfACommitWhoseAnswerWasLost) {
  const std::size_t host = uri.find("host=") + 5;
  Proxy proxy(uri.substr(host));
  PostgresStores stores(uri.substr(0, host) + proxy.directory(), {.connections = 1});
  StoreCalls calls(stores.all());
  calls.submit(job_named(numbered_id(1)), "{}");
  proxy.next_commit = Proxy::Cut::answer;
  calls.submit(job_named(numbered_id(2)), "{}");
  proxy.next_commit = Proxy::Cut::request;
  calls.submit(job_named(numbered_id(3)), "{}");
  const Claim claim = calls.claim("boot", 1, 1'000'000, false).value();
  proxy.next_commit = Proxy::Cut::answer;
  EXPECT_TRUE(calls.succeed(claim.job.id, claim.fence, 2, "{}", {})) << "the first attempt was the successful one";
  EXPECT_EQ(proxy.cuts, 3);
  EXPECT_EQ(calls.count(JobState::queued), 2);
  EXPECT_EQ(calls.count(JobState::succeeded), 1);
}

/// After a crash the server assigns ids again whose transactions were not on the disk.
TEST_F(PostgresStoresTest, DoesNotTakeAnotherTransactionOfTheSameIdForItsOwn) {
  PostgresServer own;
  const std::string own_uri = own.new_database();
  PostgresStores stores(own_uri);
  StoreCalls calls(stores.all());
  calls.submit(job_named(numbered_id(1)), "{}");
  own.sql(own_uri, "ALTER SYSTEM SET wal_writer_delay = '10s'");
  own.sql(own_uri, "SELECT pg_reload_conf()");
  own.sql(own_uri,
          "CREATE FUNCTION wait_in_commit() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
          " IF pg_postmaster_start_time() = '" +
              own.sql(own_uri, "SELECT pg_postmaster_start_time()") +
              "' THEN PERFORM pg_sleep(600); END IF; RETURN NULL; END $$");
  own.sql(own_uri,
          "CREATE CONSTRAINT TRIGGER wait_in_commit AFTER INSERT ON jobs DEFERRABLE INITIALLY DEFERRED FOR EACH ROW"
          " WHEN (new.id = '" +
              numbered_id(2) + "') EXECUTE FUNCTION wait_in_commit()");
  Failure failure;
  std::thread submitting([&] { failure = failure_of([&] { calls.submit(job_named(numbered_id(2)), "{}"); }); });
  const std::string commit = "SELECT backend_xid FROM pg_stat_activity WHERE wait_event = 'PgSleep'";
  std::string id;
  while ((id = own.sql(own_uri, commit)).empty()) usleep(10'000);
  own.kill();
  own.start();
  own.sql(own_uri, "DO $$ BEGIN WHILE pg_current_xact_id() < '" + id + "'::xid8 LOOP COMMIT; END LOOP; END $$");
  submitting.join();
  EXPECT_EQ(failure.kind.has_value(), calls.count(JobState::queued) == 1) << "an acknowledged job is stored";
  if (failure.kind) {
    EXPECT_EQ(failure.kind, StoreFailure::Kind::unknown);
  }
}

TEST_F(PostgresStoresTest, TheLastJobsOfABatchRemovedAtOnceLeaveNothing) {
  PostgresStores first(uri), second(uri);
  StoreCalls one(first.all()), other(second.all());
  for (int round = 0; round < 20; ++round) {
    const std::string batch = numbered_id(1000 + round), left = numbered_id(2 * round),
                      right = numbered_id(2 * round + 1);
    InsertRequest request;
    for (const std::string& id : {left, right}) {
      Job job = job_named(id);
      job.batch = batch;
      request.jobs.push_back({job, "[]"});
    }
    request.batch = Batch{batch, "", "", "", 1, {}, 2};
    request.scene = CommonScene{"{}", {}};
    one.insert(request, 1);
    std::thread remover([&] { one.remove(left); });
    other.remove(right);
    remover.join();
    ASSERT_FALSE(one.find_batch(batch)) << round;
  }
  EXPECT_EQ(server.sql(uri, "SELECT count(*) FROM scenes"), "0");
}
