/// What a DeliveryStore promises, and that its file keeps it.

#include <gtest/gtest.h>

#include <memory>

#include "server/jobs/job_store.h"
#include "server/storage/sqlite/sqlite_delivery_store.h"
#include "tests/conformance/temporary_folder.h"

using namespace jobs;

namespace {

class DeliveryStoreTest : public testing::Test {
 protected:
  DeliveryStore& store() { return *store_; }
  void reopen() {
    store_.reset();
    store_ = std::make_unique<SqliteDeliveryStore>(folder_.path());
  }
  Delivery owe(const std::string& id, const std::string& job_id, std::int64_t at) {
    Delivery delivery{id, job_id, "job.failed", "https://example.com/", "{}", DeliveryState::pending, at, at, {}};
    store().owe(delivery);
    return delivery;
  }
  std::string next_id() {
    const auto delivery = store().next();
    return delivery ? delivery->id : "none";
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<DeliveryStore> store_ = std::make_unique<SqliteDeliveryStore>(folder_.path());
};

}  // namespace

TEST_F(DeliveryStoreTest, KeepsSubscriptionsUntilTheyAreEnded) {
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

TEST_F(DeliveryStoreTest, ADeliveryTakesThePlaceOfItsSubscription) {
  store().subscribe({"a", "http://a/", {"failed"}});
  const Delivery owed = owe("1", "a", 1000);
  reopen();
  EXPECT_FALSE(store().subscription("a"));
  const Delivery found = store().next().value();
  EXPECT_EQ(found.id + found.job_id + found.event + found.url + found.body,
            owed.id + owed.job_id + owed.event + owed.url + owed.body);
  EXPECT_EQ(found.state, DeliveryState::pending);
  EXPECT_EQ(found.created_at, 1000);
  EXPECT_EQ(found.next_attempt_at, 1000);
  EXPECT_TRUE(found.attempts.empty());
}

TEST_F(DeliveryStoreTest, GivesTheEarliestFirstAndNoneThatIsOver) {
  EXPECT_EQ(next_id(), "none");
  owe("1", "a", 300);
  owe("2", "b", 100);
  owe("3", "c", 200);
  EXPECT_EQ(next_id(), "2");
  store().attempted("2", {101, 7, 0, "no route"}, DeliveryState::pending, 250);
  EXPECT_EQ(next_id(), "3");
  store().attempted("3", {102, 7, 200, ""}, DeliveryState::delivered, std::nullopt);
  EXPECT_EQ(next_id(), "2");
  store().attempted("2", {251, 7, 410, "gone"}, DeliveryState::given_up, std::nullopt);
  EXPECT_EQ(next_id(), "1");
}

TEST_F(DeliveryStoreTest, KeepsTheLogOfEveryAttempt) {
  owe("1", "a", 100);
  store().attempted("1", {100, 5000, 0, "timed out"}, DeliveryState::pending, 200);
  store().attempted("1", {200, 12, 503, "the receiver answered 503"}, DeliveryState::pending, 300);
  store().attempted("1", {300, 9, 204, ""}, DeliveryState::delivered, std::nullopt);
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

TEST_F(DeliveryStoreTest, ForgetsWhatIsOldAndOverWithItsLog) {
  for (const char* id : {"1", "2", "3"}) owe(id, "a", 100);
  owe("4", "a", 200);
  store().attempted("1", {100, 1, 200, ""}, DeliveryState::delivered, std::nullopt);
  store().attempted("2", {100, 1, 0, "?"}, DeliveryState::given_up, std::nullopt);
  store().attempted("4", {100, 1, 200, ""}, DeliveryState::delivered, std::nullopt);
  store().forget_before(200);
  std::string left;
  for (const Delivery& delivery : store().of_job("a")) left += delivery.id;
  EXPECT_EQ(left, "34");
}

TEST_F(DeliveryStoreTest, AFailedCallChangesNothing) {
  store().subscribe({"a", "http://a/", {"failed"}});
  owe("1", "b", 100);
  EXPECT_THROW(owe("1", "a", 100), std::logic_error) << "the id is there";
  EXPECT_TRUE(store().subscription("a"));
  EXPECT_EQ(next_id(), "1");
}
