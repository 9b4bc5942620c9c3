/// Who is told, when, and when again: over a real store, a clock that tests turn, and a receiver that does as it is
/// told.

#include "server/webhooks/webhooks.h"

#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <memory>

#include "server/storage/sqlite/sqlite_delivery_store.h"
#include "tests/conformance/temporary_folder.h"
#include "tests/queue/eventually.h"

using namespace webhooks;
using jobs::Delivery;
using jobs::DeliveryState;
using jobs::JobState;

namespace {

class WebhooksTest : public testing::Test {
 protected:
  struct Sent {
    std::string url, body;
    std::map<std::string, std::string> headers;
  };

  void start() {
    WebhookSettings settings;
    settings.secrets = *read_secrets("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
    settings.store_pause = std::chrono::milliseconds(1);
    webhooks_.emplace(
        *store_, [this](const std::string& id) { return find(id); },
        [this](const auto& url, const auto& headers, const auto& body, const auto&) {
          return receive(url, headers, body);
        },
        [this] { return now.load(); }, ids_, jobs::no_log(), settings);
  }
  void stop() { webhooks_.reset(); }

  void place(const std::string& id, JobState state) {
    const std::lock_guard lock(mutex_);
    jobs_[id] = state;
  }
  void submit(const std::string& id, std::vector<std::string> events = {"succeeded", "failed", "cancelled"}) {
    webhooks_->expect(id, {"http://receiver/" + id, std::move(events)});
    place(id, JobState::queued);
  }
  void end(const std::string& id, JobState state) {
    place(id, state);
    webhooks_->ended(id);
  }
  void answer_next(std::deque<int> statuses) {
    const std::lock_guard lock(mutex_);
    answers_ = std::move(statuses);
  }
  std::vector<Sent> sent() {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  void wait_for_attempts(std::size_t count) {
    ASSERT_TRUE(eventually([&] { return sent().size() >= count; }));
  }
  Delivery delivery(const std::string& job_id) {
    const std::vector<Delivery> all = store_->of_job(job_id);
    return all.size() == 1 ? all.front() : Delivery{};
  }

  std::atomic<std::int64_t> now = 1'700'000'000'000;

 private:
  std::optional<jobs::JobView> find(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return std::nullopt;
    jobs::JobView view;
    view.job.id = id;
    view.job.state = found->second;
    return view;
  }
  Answer receive(const std::string& url, const Poster::Headers& headers, const std::string& body) {
    const std::lock_guard lock(mutex_);
    sent_.push_back({url, body, {headers.begin(), headers.end()}});
    int status = 200;
    if (!answers_.empty()) {
      status = answers_.front();
      answers_.pop_front();
    }
    return {status, status == 0 ? "no route" : ""};
  }

  TemporaryFolder folder_;
  jobs::IdSource ids_{jobs::system_clock(), jobs::system_random()};
  std::mutex mutex_;
  std::map<std::string, JobState> jobs_;
  std::deque<int> answers_;
  std::vector<Sent> sent_;

 protected:
  std::unique_ptr<jobs::SqliteDeliveryStore> store_ = std::make_unique<jobs::SqliteDeliveryStore>(folder_.path());
  std::optional<Webhooks> webhooks_;  ///< last: goes first
};

}  // namespace

TEST_F(WebhooksTest, AnEndIsToldOnceSignedAndWithTheJob) {
  start();
  submit("a");
  end("a", JobState::succeeded);
  ASSERT_TRUE(eventually([&] { return delivery("a").state == DeliveryState::delivered; }));
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
  EXPECT_TRUE(store_->subscribed_jobs().empty());
}

TEST_F(WebhooksTest, EndsThatNobodyAskedForAreNotTold) {
  start();
  submit("a", {"failed"});
  submit("b", {"cancelled", "failed"});
  end("a", JobState::succeeded);
  end("unknown", JobState::failed);
  end("b", JobState::cancelled);
  ASSERT_TRUE(eventually([&] { return delivery("b").state == DeliveryState::delivered; }));
  ASSERT_TRUE(eventually([&] { return store_->subscribed_jobs().empty(); }));
  EXPECT_EQ(sent().size(), 1u);
  EXPECT_TRUE(store_->of_job("a").empty());
}

TEST_F(WebhooksTest, AFailedAttemptIsRepeatedAfterGrowingPausesWithTheSameMessageAndThenGivenUp) {
  start();
  answer_next({500, 0, 302, 404, 503, 400, 429, 500, 200});
  submit("a");
  end("a", JobState::failed);
  std::size_t attempts = 1;
  for (const auto pause : retry_pauses) {
    wait_for_attempts(attempts);
    ASSERT_TRUE(eventually([&] { return delivery("a").attempts.size() == attempts; }));
    EXPECT_EQ(delivery("a").state, DeliveryState::pending);
    EXPECT_EQ(delivery("a").next_attempt_at, now + pause.count());
    now += pause.count();
    webhooks_->expect("wakes", {"http://x/", {"failed"}});
    end("wakes", JobState::succeeded);  // the clock was turned; nobody else tells the thread
    ++attempts;
  }
  ASSERT_TRUE(eventually([&] { return delivery("a").state == DeliveryState::given_up; }));
  EXPECT_EQ(sent().size(), retry_pauses.size() + 1);
  for (const Sent& one : sent()) {
    EXPECT_EQ(one.body, sent().front().body);
    EXPECT_EQ(one.headers.at("webhook-id"), sent().front().headers.at("webhook-id"));
  }
  EXPECT_NE(sent().front().headers.at("webhook-timestamp"), sent().back().headers.at("webhook-timestamp"));
  EXPECT_EQ(delivery("a").attempts[1].detail, "no route");
  EXPECT_EQ(delivery("a").attempts[2].detail, "the receiver answered 302");
}

TEST_F(WebhooksTest, AReceiverThatIsGoneIsNotAskedAgain) {
  start();
  answer_next({410});
  submit("a");
  end("a", JobState::failed);
  ASSERT_TRUE(eventually([&] { return delivery("a").state == DeliveryState::given_up; }));
  EXPECT_EQ(sent().size(), 1u);
}

TEST_F(WebhooksTest, WhatIsOwedSurvivesARestart) {
  start();
  answer_next({500});
  submit("a");
  submit("b");
  submit("c");
  submit("waits");
  end("a", JobState::failed);
  wait_for_attempts(1);
  ASSERT_TRUE(eventually([&] { return delivery("a").attempts.size() == 1; }));
  stop();
  place("b", JobState::succeeded);  // ends while nobody listens
  now += retry_pauses[0].count();
  start();
  ASSERT_TRUE(eventually([&] { return delivery("a").state == DeliveryState::delivered; }));
  ASSERT_TRUE(eventually([&] { return delivery("b").state == DeliveryState::delivered; }));
  EXPECT_TRUE(store_->of_job("c").empty());
  end("c", JobState::cancelled);
  ASSERT_TRUE(eventually([&] { return delivery("c").state == DeliveryState::delivered; }));
  EXPECT_EQ(store_->subscribed_jobs(), std::vector<std::string>{"waits"});
}

TEST_F(WebhooksTest, AWishWhoseJobWasNeverStoredIsStruckAtTheNextStart) {
  store_->subscribe({"never", "http://x/", {"failed"}});
  start();
  EXPECT_TRUE(store_->subscribed_jobs().empty());
}

TEST_F(WebhooksTest, AJobThatIsRemovedIsNotToldOf) {
  start();
  webhooks_->expect("a", {"http://x/", {"failed"}});
  webhooks_->ended("a");
  ASSERT_TRUE(eventually([&] { return store_->subscribed_jobs().empty(); }));
  EXPECT_TRUE(store_->of_job("a").empty());
  EXPECT_TRUE(sent().empty());
}
