/// The state that nodes share beside the jobs: the order of events, messages, nodes.

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "server/storage/postgres/postgres_stores.h"
#include "tests/conformance/test_store.h"
#include "tests/support/postgres_server.h"
#include "tests/support/threads.h"

using namespace queue;
using storage::postgres::PostgresStores;

namespace {

/// The messages of one topic.
class Inbox {
 public:
  void add(const std::string& id) {
    const std::lock_guard lock(mutex_);
    ids_.insert(id);
    arrived_.notify_all();
  }
  void wait_for(const std::string& id) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return ids_.contains(id); });
  }
  std::multiset<std::string> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(ids_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::multiset<std::string> ids_;
};

class PostgresClusterTest : public PostgresTest {};

}  // namespace

TEST_F(PostgresClusterTest, EventsOfTransactionsThatEndInAnyOrderHaveNoGapsAndAreReadOnce) {
  constexpr int writers = 4, jobs_per_writer = 60;
  PostgresStores stores(uri), readers(uri);
  std::atomic<bool> running = true;
  const std::jthread writing([&] {
    in_threads(writers, [&](int writer) {
      StoreCalls calls(stores.all());
      for (int i = 0; i < jobs_per_writer; ++i) {
        const Job job = job_named(numbered_id(writer * 1000 + i));
        calls.submit(job, "{}");
        calls.cancel(job.id, 2);
        stores.cluster().number_events();
      }
    });
    running = false;
  });
  std::vector<JobEvent> seen;
  for (bool is_last = false; !is_last;) {
    is_last = !running;
    if (is_last) readers.cluster().number_events();
    for (const JobEvent& event : readers.cluster().events_after(static_cast<std::int64_t>(seen.size()), 50))
      seen.push_back(event);
    if (is_last && readers.cluster().event_range().last != static_cast<std::int64_t>(seen.size())) is_last = false;
  }
  ASSERT_EQ(seen.size(), std::size_t{2 * writers * jobs_per_writer});
  std::map<std::string, std::string> states;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].number, static_cast<std::int64_t>(i) + 1);
    states[seen[i].job.id] += seen[i].state + " ";
  }
  EXPECT_EQ(states.size(), std::size_t{writers * jobs_per_writer});
  for (const auto& [id, text] : states) EXPECT_EQ(text, "queued cancelled ") << id;
}

TEST_F(PostgresClusterTest, KeepsTheLatestEvents) {
  const PostgresStores stores(uri);
  server.sql(uri,
             "INSERT INTO new_events (state, job_id, kind, name, owner, keep)"
             " SELECT 'queued', 'job', 'render', i, '', 1 FROM generate_series(1, 12001) AS i");
  EXPECT_EQ(stores.cluster().number_events(), 12001);
  EXPECT_EQ(stores.cluster().number_events(), 0);
  const ClusterStore::EventRange range = stores.cluster().event_range();
  EXPECT_EQ(std::pair(range.first, range.last), std::pair(std::int64_t{2002}, std::int64_t{12001}));
  const std::vector<JobEvent> events = stores.cluster().events_after(0, 1);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.front().number, 2002);
  EXPECT_EQ(events.front().job.name, "2002");
}

TEST_F(PostgresClusterTest, OneCallerNumbersEventsAtATime) {
  const PostgresStores stores(uri);
  StoreCalls(stores.all()).submit(job_named(numbered_id(1)), "{}");
  const storage::postgres::PostgresStores other(uri);
  other.transactions().write([&](storage::sql::Database& database) {
    storage::sql::Query numbered = database.query("SELECT number_events()");
    numbered.row();
    EXPECT_EQ(numbered.integer(0), 1);
    EXPECT_EQ(stores.cluster().number_events(), std::nullopt) << "the other one has not committed";
    return 0;
  });
  EXPECT_EQ(stores.cluster().number_events(), 0);
  EXPECT_EQ(stores.cluster().events_after(0, 10).size(), 1U);
}

TEST_F(PostgresClusterTest, AnnouncesChangesOfTheOwnerAndRemovals) {
  const PostgresStores stores(uri);
  StoreCalls calls(stores.all());
  const Job job = job_named(numbered_id(1));
  calls.submit(job, "{}");
  stores.all().jobs.change(job.id, {.priority = {}, .name = "renamed", .labels = {}, .expires_at = {}}, {});
  calls.cancel(job.id, 2);
  calls.remove(job.id);
  stores.cluster().number_events();
  std::string text;
  for (const JobEvent& event : stores.cluster().events_after(0, 10)) text += event.job.name + ":" + event.state + " ";
  EXPECT_EQ(text, ":queued renamed:queued renamed:cancelled renamed:removed ");
}

TEST_F(PostgresClusterTest, MessagesReachTheOtherNodesAlsoOverALostConnection) {
  PostgresStores first(uri), second(uri);
  Inbox own, other;
  const auto add_own = first.wakeups().subscribe("topic", [&](const std::string& id) { own.add(id); });
  const auto add_other = second.wakeups().subscribe("topic", [&](const std::string& id) { other.add(id); });
  const std::string both_listen =
      "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND query LIKE '%LISTEN%'";
  while (server.sql(uri, both_listen + " AND pid <> pg_backend_pid()") != "2") std::this_thread::yield();
  first.wakeups().publish("other_topic", "1");
  first.wakeups().publish("topic", "some id");
  other.wait_for("some id");
  own.take();
  other.take();
  server.sql(uri,
             "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
             " AND pid <> pg_backend_pid()");
  own.wait_for("");
  other.wait_for("");
  first.wakeups().publish("topic", "2");
  other.wait_for("2");
  EXPECT_FALSE(own.take().contains("2")) << "a node does not receive its own messages";
}

TEST_F(PostgresClusterTest, MoreMessagesThanFitIntoOneNotificationArrive) {
  PostgresStores first(uri), second(uri);
  Inbox inbox;
  const auto subscription = second.wakeups().subscribe("topic", [&](const std::string& id) { inbox.add(id); });
  inbox.wait_for("");
  const std::string long_id(900, 'x');
  for (int i = 0; i < 30; ++i) first.wakeups().publish("topic", long_id + std::to_string(i));
  for (int i = 0; i < 30; ++i) inbox.wait_for(long_id + std::to_string(i));
}

TEST_F(PostgresClusterTest, ReportsNodesAndTheirDuties) {
  const PostgresStores stores(uri);
  StoreCalls calls(stores.all());
  Node node{.id = "boot", .name = "machine", .role = "all", .version = "1", .slots = 2, .running = 1};
  EXPECT_FALSE(stores.cluster().report_node(node).suspects_wait);
  calls.submit(job_named(numbered_id(1)), "{}");
  ASSERT_TRUE(calls.claim("boot", 1, 1'000'000, false));
  calls.cancel(numbered_id(1), 2);
  Job suspect = job_named(numbered_id(2));
  suspect.suspect = true;
  calls.submit(suspect, "{}");
  node.running = 0;
  const ClusterStore::Duties duties = stores.cluster().report_node(node);
  EXPECT_EQ(duties.cancelled, std::vector{numbered_id(1)});
  EXPECT_TRUE(duties.suspects_wait);
  server.sql(uri, "INSERT INTO nodes VALUES ('old', 'gone', 'all', '1', 1, 0, 1, 1)");
  stores.cluster().report_node(node);
  const std::vector<Node> nodes = stores.cluster().nodes();
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(std::tie(nodes[0].id, nodes[0].name, nodes[0].running), std::make_tuple("boot", "machine", 0));
  EXPECT_GT(nodes[0].seen_at, 0);
  stores.cluster().remove_node("boot");
  EXPECT_TRUE(stores.cluster().nodes().empty());
}

TEST_F(PostgresClusterTest, ADeliveryIsSentByOneNode) {
  const PostgresStores first(uri), second(uri);
  first.deliveries().subscribe({"job", "http://host/", {"succeeded"}});
  const Delivery delivery{"1", "job", "job.succeeded", "http://host/", "{}", DeliveryState::pending, 5, 5, {}};
  Delivery again = delivery;
  again.id = "2";
  EXPECT_TRUE(first.deliveries().replace_subscription(delivery));
  EXPECT_FALSE(second.deliveries().replace_subscription(again));
  const Delivery due = second.deliveries().next({}).value();
  EXPECT_TRUE(first.deliveries().reserve(due, 1000));
  EXPECT_FALSE(second.deliveries().reserve(due, 1000));
  const Delivery left = second.deliveries().next({}).value();
  EXPECT_EQ(left.next_attempt_at, 1000) << "then the first node is gone";
  EXPECT_TRUE(second.deliveries().reserve(left, 2000));
}

TEST_F(PostgresClusterTest, HandsOnResultsOfRunningJobs) {
  const PostgresStores first(uri), second(uri);
  const std::string bytes("\0\xFF png", 6);
  first.cluster().put_result("job", "preview 64", "older");
  first.cluster().put_result("job", "preview 64", bytes);
  EXPECT_EQ(second.cluster().find_result("job", "preview 64"), bytes);
  EXPECT_FALSE(second.cluster().find_result("job", "preview 128"));
}
