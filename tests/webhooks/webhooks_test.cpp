/// Subscriptions, deliveries and retries, with a real store, a manual clock and a scripted receiver.

#include "server/webhooks/webhooks.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <map>
#include <set>

#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/support/threads.h"

using namespace webhooks;
using queue::Delivery;
using queue::DeliveryState;
using queue::JobState;

namespace {

class WebhooksTest : public testing::Test {
 protected:
  struct Sent {
    std::string url, body;
    std::map<std::string, std::string> headers;
  };

  void start(std::size_t senders = 4) {
    WebhookSettings settings;
    settings.senders = senders;
    settings.secrets = *read_secrets("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
    settings.store_pause = std::chrono::milliseconds(1);
    webhooks_under_test.emplace(
        store, [this](const std::string& id) { return find(id); },
        [this](const auto& url, const auto& headers, const auto& body, const auto& stop) {
          return receive(url, headers, body, stop);
        },
        [this] { return now.load(); }, ids_, queue::no_log(), settings);
  }
  void stop() { webhooks_under_test.reset(); }

  void place(const std::string& id, JobState state) {
    const std::lock_guard lock(mutex_);
    jobs_[id] = state;
  }
  void submit(const std::string& id, std::vector<std::string> events = {"succeeded", "failed", "cancelled"},
              const std::string& receiver = "receiver") {
    webhooks_under_test->register_webhook(id, {"http://" + receiver + "/" + id, std::move(events)});
    place(id, JobState::queued);
  }
  /// A failed job with a webhook of `receiver`.
  void fail_job(const std::string& id, const std::string& receiver) {
    submit(id, {"failed"}, receiver);
    end(id, JobState::failed);
  }
  /// Receivers of this name do not answer while they hang.
  void hang(const std::string& receiver, bool hangs) {
    const std::lock_guard lock(mutex_);
    if (hangs) {
      hanging_.insert(receiver);
    } else {
      hanging_.erase(receiver);
    }
    changed_.notify_all();
  }
  void end(const std::string& id, JobState state) {
    place(id, state);
    webhooks_under_test->on_ended(id);
  }
  void respond_next(std::deque<int> statuses) {
    const std::lock_guard lock(mutex_);
    statuses_ = std::move(statuses);
  }
  std::vector<Sent> sent() {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  void wait_for_attempts(std::size_t count) {
    ASSERT_TRUE(eventually([&] { return sent().size() >= count; }));
  }
  Delivery delivery(const std::string& job_id) {
    const std::vector<Delivery> all = store.of_job(job_id);
    return all.size() == 1 ? all.front() : Delivery{};
  }

  bool becomes(const std::string& job_id, DeliveryState state) {
    return eventually([&] { return delivery(job_id).state == state; });
  }

  std::atomic<std::int64_t> now = 1'700'000'000'000;
  int max_per_receiver = 0;       ///< concurrent requests to one receiver
  std::size_t max_receivers = 0;  ///< with concurrent requests

 private:
  std::optional<queue::JobView> find(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return std::nullopt;
    queue::JobView view;
    view.job.id = id;
    view.job.state = found->second;
    return view;
  }
  Response receive(const std::string& url, const WebhookSender::Headers& headers, const std::string& body,
                   const std::atomic<bool>& stop) {
    std::unique_lock lock(mutex_);
    sent_.push_back({url, body, {headers.begin(), headers.end()}});
    const std::string receiver = queue::host_of(url);
    max_per_receiver = std::max(max_per_receiver, ++at_once_[receiver]);
    max_receivers = std::max(max_receivers, at_once_.size());
    while (hanging_.contains(receiver) && !stop) changed_.wait_for(lock, std::chrono::milliseconds(1));
    if (--at_once_[receiver] == 0) at_once_.erase(receiver);
    if (stop) return {0, "stopped"};
    int status = 200;
    if (!statuses_.empty()) {
      status = statuses_.front();
      statuses_.pop_front();
    }
    return {status, status == 0 ? "no route" : ""};
  }

  TemporaryDirectory directory_;
  queue::IdSource ids_{queue::system_clock(), queue::system_random()};
  std::mutex mutex_;
  std::map<std::string, JobState> jobs_;
  std::deque<int> statuses_;
  std::vector<Sent> sent_;
  std::set<std::string> hanging_;
  std::map<std::string, int> at_once_;
  std::condition_variable changed_;

 protected:
  storage::sqlite::SqliteStores stores{directory_.path()};
  queue::DeliveryStore& store = stores.deliveries();
  std::optional<Webhooks> webhooks_under_test;  ///< last: destroyed first
};

}  // namespace

TEST_F(WebhooksTest, DeliversAnEndOnceSignedAndWithTheJob) {
  start();
  submit("a");
  end("a", JobState::succeeded);
  ASSERT_TRUE(becomes("a", DeliveryState::delivered));
  const std::vector<Sent> all = sent();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].url, "http://receiver/a");
  EXPECT_EQ(all[0].body.rfind(R"({"type":"job.succeeded","timestamp":"2023-11-14T22:13:20.000Z","data":{"id":"a")", 0),
            0u)
      << all[0].body;
  EXPECT_EQ(all[0].headers.at("webhook-id"), delivery("a").id);
  EXPECT_EQ(all[0].headers.at("webhook-timestamp"), "1700000000");
  EXPECT_EQ(all[0].headers.at("webhook-signature"), signature(*read_secrets("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"),
                                                              delivery("a").id, 1'700'000'000, all[0].body));
  EXPECT_TRUE(store.subscribed_jobs().empty());
}

TEST_F(WebhooksTest, IgnoresEndsWithoutSubscription) {
  start();
  submit("a", {"failed"});
  submit("b", {"cancelled", "failed"});
  end("a", JobState::succeeded);
  end("unknown", JobState::failed);
  end("b", JobState::cancelled);
  ASSERT_TRUE(becomes("b", DeliveryState::delivered));
  ASSERT_TRUE(eventually([&] { return store.subscribed_jobs().empty(); }));
  EXPECT_EQ(sent().size(), 1u);
  EXPECT_TRUE(store.of_job("a").empty());
}

TEST_F(WebhooksTest, RetriesTheSameMessageAfterGrowingPausesAndThenAbandonsIt) {
  start();
  respond_next({500, 0, 302, 404, 503, 400, 429, 500, 200});
  submit("a");
  end("a", JobState::failed);
  std::size_t attempts = 1;
  for (const auto pause : retry_pauses) {
    wait_for_attempts(attempts);
    ASSERT_TRUE(eventually([&] { return delivery("a").attempts.size() == attempts; }));
    EXPECT_EQ(delivery("a").state, DeliveryState::pending);
    EXPECT_EQ(delivery("a").next_attempt_at, now + pause.count());
    now += pause.count();
    webhooks_under_test->register_webhook("wakes", {"http://x/", {"failed"}});
    end("wakes", JobState::succeeded);  // the thread does not notice that the clock was changed
    ++attempts;
  }
  ASSERT_TRUE(becomes("a", DeliveryState::abandoned));
  EXPECT_EQ(sent().size(), retry_pauses.size() + 1);
  for (const Sent& one : sent()) {
    EXPECT_EQ(one.body, sent().front().body);
    EXPECT_EQ(one.headers.at("webhook-id"), sent().front().headers.at("webhook-id"));
  }
  EXPECT_NE(sent().front().headers.at("webhook-timestamp"), sent().back().headers.at("webhook-timestamp"));
  EXPECT_EQ(delivery("a").attempts[1].detail, "no route");
  EXPECT_EQ(delivery("a").attempts[2].detail, "the receiver answered 302");
}

TEST_F(WebhooksTest, AbandonsADeliveryAfterStatus410) {
  start();
  respond_next({410});
  submit("a");
  end("a", JobState::failed);
  ASSERT_TRUE(becomes("a", DeliveryState::abandoned));
  EXPECT_EQ(sent().size(), 1u);
}

TEST_F(WebhooksTest, KeepsDeliveriesOverARestart) {
  start();
  respond_next({500});
  submit("a");
  submit("b");
  submit("c");
  submit("waits");
  end("a", JobState::failed);
  wait_for_attempts(1);
  ASSERT_TRUE(eventually([&] { return delivery("a").attempts.size() == 1; }));
  stop();
  place("b", JobState::succeeded);  // ends before the restart
  now += retry_pauses[0].count();
  start();
  ASSERT_TRUE(becomes("a", DeliveryState::delivered));
  ASSERT_TRUE(becomes("b", DeliveryState::delivered));
  EXPECT_TRUE(store.of_job("c").empty());
  end("c", JobState::cancelled);
  ASSERT_TRUE(becomes("c", DeliveryState::delivered));
  EXPECT_EQ(store.subscribed_jobs(), std::vector<std::string>{"waits"});
}

TEST_F(WebhooksTest, DeletesSubscriptionsOfUnknownJobsAtItsStart) {
  store.subscribe({"never", "http://x/", {"failed"}});
  start();
  EXPECT_TRUE(store.subscribed_jobs().empty());
}

TEST_F(WebhooksTest, DeliversNothingForARemovedJob) {
  start();
  webhooks_under_test->register_webhook("a", {"http://x/", {"failed"}});
  webhooks_under_test->on_ended("a");
  ASSERT_TRUE(eventually([&] { return store.subscribed_jobs().empty(); }));
  EXPECT_TRUE(store.of_job("a").empty());
  EXPECT_TRUE(sent().empty());
}

TEST_F(WebhooksTest, DeliversBesideAHangingReceiver) {
  start();
  hang("slow", true);
  for (const char* id : {"s1", "s2", "s3"}) fail_job(id, "slow");
  wait_for_attempts(1);
  for (const char* id : {"q1", "q2"}) fail_job(id, "quick");
  fail_job("o", "other");
  for (const char* id : {"q1", "q2", "o"}) EXPECT_TRUE(becomes(id, DeliveryState::delivered)) << id;
  EXPECT_EQ(delivery("s1").attempts.size() + delivery("s2").attempts.size(), 0u);
  hang("slow", false);
  EXPECT_TRUE(becomes("s3", DeliveryState::delivered));
}

TEST_F(WebhooksTest, DeliversOneMessageAtATimeToAReceiverInOrder) {
  start();
  hang("slow", true);
  std::vector<std::string> urls;
  for (int i = 10; i < 30; ++i) {
    const std::string id = std::to_string(i);
    fail_job(id, "slow");
    ASSERT_TRUE(eventually([&] { return store.of_job(id).size() == 1; }));
    urls.push_back("http://slow/" + id);
    ++now;
  }
  hang("slow", false);
  ASSERT_TRUE(becomes("29", DeliveryState::delivered));
  std::vector<std::string> got;
  for (const Sent& one : sent()) got.push_back(one.url);
  EXPECT_EQ(got, urls);
  EXPECT_EQ(max_per_receiver, 1);
}

TEST_F(WebhooksTest, LimitsConcurrentReceiversToTheSenders) {
  start(2);
  const std::vector<std::string> receivers{"a", "b", "c", "d"};
  for (const std::string& receiver : receivers) hang(receiver, true);
  for (const std::string& receiver : receivers) fail_job(receiver, receiver);
  wait_for_attempts(2);
  for (const std::string& receiver : receivers)
    ASSERT_TRUE(eventually([&] { return store.of_job(receiver).size() == 1; })) << "the delivery is pending";
  EXPECT_EQ(sent().size(), 2u);
  for (const std::string& receiver : receivers) hang(receiver, false);
  for (const std::string& receiver : receivers) EXPECT_TRUE(becomes(receiver, DeliveryState::delivered)) << receiver;
  EXPECT_EQ(max_receivers, 2u);
}

TEST_F(WebhooksTest, CountsNoAttemptForARequestInterruptedByItsEnd) {
  start();
  for (const char* receiver : {"a", "b"}) hang(receiver, true);
  for (const char* receiver : {"a", "b"}) fail_job(receiver, receiver);
  wait_for_attempts(2);
  stop();
  for (const char* receiver : {"a", "b"}) {
    EXPECT_EQ(delivery(receiver).state, DeliveryState::pending);
    EXPECT_TRUE(delivery(receiver).attempts.empty());
    hang(receiver, false);
  }
  start();
  for (const char* receiver : {"a", "b"}) EXPECT_TRUE(becomes(receiver, DeliveryState::delivered)) << receiver;
}
