/// The contract of DeliveryStore, and its persistence.

#include <gtest/gtest.h>

#include <optional>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/temporary_directory.h"

using namespace queue;

namespace {

class DeliveryStoreTest : public testing::Test {
 protected:
  DeliveryStore& store() { return stores_->deliveries(); }
  void reopen() {
    stores_.reset();
    stores_.emplace(directory_.path());
  }
  Delivery enqueue(const std::string& id, const std::string& job_id, std::int64_t at,
                   const std::string& url = "https://example.com/") {
    Delivery delivery{id, job_id, "job.failed", url, "{}", DeliveryState::pending, at, at, {}};
    store().enqueue(delivery);
    return delivery;
  }
  std::string next_id(const std::set<std::string>& busy = {}) {
    const auto delivery = store().next(busy);
    return delivery ? delivery->id : "none";
  }

 private:
  TemporaryDirectory directory_;
  std::optional<storage::sqlite::SqliteStores> stores_{directory_.path()};
};

}  // namespace

TEST_F(DeliveryStoreTest, KeepsSubscriptionsUntilUnsubscribe) {
  store().subscribe({"a", "https://example.com/a?b=c", {"failed", "succeeded"}});
  store().subscribe({"b", "http://b/", {"failed"}});
  store().subscribe({"b", "http://c/", {"cancelled"}});
  reopen();
  EXPECT_EQ(store().subscribed_jobs(), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(store().subscription("a")->url, "https://example.com/a?b=c");
  EXPECT_EQ(store().subscription("a")->events, (std::vector<std::string>{"failed", "succeeded"}));
  EXPECT_EQ(store().subscription("b")->url, "http://c/");
  store().unsubscribe("a");
  store().unsubscribe("unknown");
  EXPECT_FALSE(store().subscription("a"));
  EXPECT_EQ(store().subscribed_jobs(), std::vector<std::string>{"b"});
}

TEST_F(DeliveryStoreTest, ReplacesASubscriptionByItsDelivery) {
  store().subscribe({"a", "http://a/", {"failed"}});
  Delivery owed = enqueue("0", "b", 2000);
  EXPECT_TRUE(store().subscription("a"));
  owed.id = "1", owed.job_id = "a", owed.created_at = 1000, owed.next_attempt_at = 1000;
  EXPECT_TRUE(store().replace_subscription(owed));
  EXPECT_FALSE(store().replace_subscription(owed)) << "another caller has done so";
  reopen();
  EXPECT_FALSE(store().subscription("a"));
  const Delivery found = store().next({}).value();
  EXPECT_EQ(found.id + found.job_id + found.event + found.url + found.body,
            owed.id + owed.job_id + owed.event + owed.url + owed.body);
  EXPECT_EQ(found.state, DeliveryState::pending);
  EXPECT_EQ(found.created_at, 1000);
  EXPECT_EQ(found.next_attempt_at, 1000);
  EXPECT_TRUE(found.attempts.empty());
}

TEST_F(DeliveryStoreTest, ReturnsTheEarliestPendingDelivery) {
  EXPECT_EQ(next_id(), "none");
  enqueue("1", "a", 300);
  enqueue("2", "b", 100);
  enqueue("3", "c", 200);
  EXPECT_EQ(next_id(), "2");
  store().record_attempt("2", {101, 7, 0, "no route"}, DeliveryState::pending, 250);
  EXPECT_EQ(next_id(), "3");
  store().record_attempt("3", {102, 7, 200, ""}, DeliveryState::delivered, std::nullopt);
  EXPECT_EQ(next_id(), "2");
  store().record_attempt("2", {251, 7, 410, "gone"}, DeliveryState::abandoned, std::nullopt);
  EXPECT_EQ(next_id(), "1");
}

TEST_F(DeliveryStoreTest, RecordsEveryAttempt) {
  enqueue("1", "a", 100);
  store().record_attempt("1", {100, 5000, 0, "timed out"}, DeliveryState::pending, 200);
  store().record_attempt("1", {200, 12, 503, "the receiver answered 503"}, DeliveryState::pending, 300);
  store().record_attempt("1", {300, 9, 204, ""}, DeliveryState::delivered, std::nullopt);
  reopen();
  const std::vector<Delivery> deliveries = store().of_job("a");
  ASSERT_EQ(deliveries.size(), 1u);
  EXPECT_EQ(deliveries[0].state, DeliveryState::delivered);
  EXPECT_EQ(deliveries[0].next_attempt_at, std::nullopt);
  ASSERT_EQ(deliveries[0].attempts.size(), 3u);
  EXPECT_EQ(deliveries[0].attempts[0].detail, "timed out");
  EXPECT_EQ(deliveries[0].attempts[1].status, 503);
  EXPECT_EQ(deliveries[0].attempts[2].at, 300);
  EXPECT_EQ(deliveries[0].attempts[2].duration_ms, 9);
  EXPECT_TRUE(store().of_job("b").empty());
}

TEST_F(DeliveryStoreTest, MakesADeliveryPendingAgain) {
  enqueue("1", "a", 100);
  store().record_attempt("1", {100, 1, 410, "gone"}, DeliveryState::abandoned, std::nullopt);
  EXPECT_FALSE(store().redeliver("b", "1", 500)) << "another job";
  EXPECT_FALSE(store().redeliver("a", "2", 500));
  EXPECT_EQ(next_id(), "none");
  EXPECT_TRUE(store().redeliver("a", "1", 500));
  const Delivery again = store().next({}).value();
  EXPECT_EQ(again.next_attempt_at, 500);
  EXPECT_EQ(again.attempts.size(), 1u);
}

TEST_F(DeliveryStoreTest, DeletesOldCompletedDeliveriesWithTheirAttempts) {
  for (const char* id : {"1", "2", "3"}) enqueue(id, "a", 100);
  enqueue("4", "a", 200);
  store().record_attempt("1", {100, 1, 200, ""}, DeliveryState::delivered, std::nullopt);
  store().record_attempt("2", {100, 1, 0, "?"}, DeliveryState::abandoned, std::nullopt);
  store().record_attempt("4", {100, 1, 200, ""}, DeliveryState::delivered, std::nullopt);
  store().delete_before(200);
  std::string left;
  for (const Delivery& delivery : store().of_job("a")) left += delivery.id;
  EXPECT_EQ(left, "34");
}

TEST_F(DeliveryStoreTest, ChangesNothingInAFailedCall) {
  store().subscribe({"a", "http://a/", {"failed"}});
  enqueue("1", "b", 100);
  EXPECT_THROW(enqueue("1", "a", 100), std::logic_error) << "the id is there";
  EXPECT_TRUE(store().subscription("a"));
  EXPECT_EQ(next_id(), "1");
}

TEST_F(DeliveryStoreTest, SkipsBusyHosts) {
  enqueue("1", "job", 100, "http://Slow:81/a");
  enqueue("2", "job", 101, "http://slow:81/b?c");
  enqueue("3", "job", 300, "http://slow/");
  enqueue("4", "job", 200, "https://quick/");
  enqueue("5", "job", 150, "https://quick/");
  EXPECT_EQ(next_id(), "1");
  EXPECT_EQ(next_id({"slow:81"}), "5");
  EXPECT_EQ(next_id({"slow:81", "quick"}), "3");
  EXPECT_EQ(next_id({"slow:81", "quick", "slow"}), "none");
  store().record_attempt("5", {150, 1, 200, ""}, DeliveryState::delivered, std::nullopt);
  EXPECT_EQ(next_id({"slow:81"}), "4");
}

TEST(HostOf, ReturnsHostAndPort) {
  EXPECT_EQ(host_of("http://Example.COM/a"), "example.com");
  EXPECT_EQ(host_of("https://example.com:8443?a=/b"), "example.com:8443");
  EXPECT_EQ(host_of("http://[::1]:80"), "[::1]:80");
  EXPECT_EQ(host_of("http://h#/x"), "h");
}
