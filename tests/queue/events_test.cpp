#include "server/queue/events.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>

#include "server/queue/job_store.h"
#include "tests/support/threads.h"

namespace {

using queue::Events;
using queue::JobState;

constexpr std::int64_t start_ms = 1'000;

/// "queued 3 " for event 3 of those that follow the beginning of the clock.
std::string written(const queue::JobEvent& event) {
  return event.job.id + ':' + event.state + '#' + std::to_string(event.number - start_ms * 1000) + ' ';
}

class EventsTest : public testing::Test {
 protected:
  std::int64_t now = start_ms;
  Events events{written, [this] { return now; }, {.listeners_max = 3, .kept = 4, .untaken_max = 3}};
  static std::int64_t number(std::int64_t event) { return start_ms * 1000 + event; }
};

TEST_F(EventsTest, DeliversTheEventsOfOneJobOrOfAll) {
  const auto of_a = events.listen("a", {}), of_all = events.listen({}, {});
  events.on_state_changed("a", JobState::queued);
  events.on_state_changed("b", JobState::queued);
  EXPECT_EQ(of_a->take(1000).text, "a:queued#1 ");
  EXPECT_EQ(of_all->take(1000).text, "a:queued#1 b:queued#2 ");
  EXPECT_EQ(of_all->take(1000).text, "");
}

TEST_F(EventsTest, DeliversTheEventsOfABatchAndHidesDraftsFromAll) {
  int reads = 0;
  const auto describe = [&](const std::string& id) -> std::optional<queue::JobSummary> {
    ++reads;
    if (id == "broken") throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "gone");
    return queue::JobSummary{.id = id, .batch = id == "a" ? "batch" : "", .keep = id != "draft"};
  };
  Events described(
      written, [this] { return now; }, {.untaken_max = 30}, describe);
  const auto of_batch = described.listen("batch", {}), of_all = described.listen({}, {});
  const auto of_draft = described.listen("draft", {});
  described.on_described({.id = "described", .batch = "other"});
  described.on_state_changed("described", JobState::queued);
  described.on_state_changed("described", JobState::succeeded);
  EXPECT_EQ(reads, 0) << "a job that was described is not read";
  EXPECT_EQ(of_all->take(1000).text, "described:queued#1 described:succeeded#2 ");
  for (const char* id : {"a", "broken", "draft"}) described.on_state_changed(id, JobState::running);
  now += 1000;
  described.on_progress("a", 0.5);
  described.on_state_changed("a", JobState::succeeded);
  EXPECT_EQ(reads, 3) << "progress and end do not read the job again";
  described.on_removed({.id = "a", .batch = "batch"});
  described.on_state_changed("draft", JobState::succeeded);
  EXPECT_EQ(of_batch->take(1000).text, "a:running#3 a:running#6 a:succeeded#7 a:removed#8 ");
  EXPECT_EQ(of_all->take(1000).text, "a:running#3 broken:running#4 a:running#6 a:succeeded#7 a:removed#8 ");
  EXPECT_EQ(of_draft->take(1000).text, "draft:running#5 draft:succeeded#9 ");
  EXPECT_EQ(described.listen("batch", number(3))->take(1000).text, "a:succeeded#7 a:removed#8 ");
  EXPECT_EQ(described.listen({}, number(4))->take(1000).text, "a:succeeded#7 a:removed#8 ");
}

TEST_F(EventsTest, WakesOnceUntilAllEventsAreTaken) {
  int wakes = 0;
  const auto listener = events.listen({}, {});
  events.on_state_changed("a", JobState::queued);
  listener->on_news([&] { ++wakes; });
  EXPECT_EQ(wakes, 1) << "something was there already";
  events.on_state_changed("a", JobState::running);
  EXPECT_EQ(wakes, 1);
  EXPECT_EQ(listener->take(1).text, "a:queued#1 ") << "at least one, however few bytes";
  EXPECT_EQ(listener->take(1000).text, "a:running#2 ");
  events.on_state_changed("a", JobState::succeeded);
  EXPECT_EQ(wakes, 2);
}

TEST_F(EventsTest, EndsTheListenersOfAJobWithTheJob) {
  const auto of_a = events.listen("a", {}), of_all = events.listen({}, {}), of_b = events.listen("b", {});
  events.on_state_changed("a", JobState::failed);
  events.on_removed({.id = "b"});
  EXPECT_TRUE(of_a->take(1000).over);
  EXPECT_TRUE(of_b->take(1000).over);
  EXPECT_FALSE(of_all->take(1000).over);
}

TEST_F(EventsTest, KeepsOnlyTheLatestUntakenProgressAndLimitsItsRate) {
  const auto listener = events.listen("a", {});
  events.on_state_changed("a", JobState::running);
  for (int i = 1; i <= 1000; ++i) {
    events.on_progress("a", i / 1000.0);
    ++now;
  }
  EXPECT_EQ(listener->take(1000).text, "a:running#1 a:running#6 ") << "five of 200 ms each, and the last of them";
}

TEST_F(EventsTest, IgnoresProgressWithoutListeners) {
  const auto of_b = events.listen("b", {});
  events.on_progress("a", 0.5);
  EXPECT_EQ(events.latest(), number(0));
}

TEST_F(EventsTest, EndsOnlyTheListenerThatIsTooSlow) {
  const auto slow = events.listen({}, {}), quick = events.listen({}, {});
  for (int i = 0; i < 4; ++i) {
    events.on_state_changed("a", JobState::queued);
    EXPECT_FALSE(quick->take(1000).over);
  }
  const Events::Batch batch = slow->take(1000);
  EXPECT_EQ(batch.text, "");
  EXPECT_TRUE(batch.over);
}

TEST_F(EventsTest, ContinuesAfterAnEventThatIsKept) {
  for (const char* id : {"a", "b", "a"}) events.on_state_changed(id, JobState::queued);
  const auto listener = events.listen("a", number(1));
  EXPECT_FALSE(listener->missed());
  EXPECT_EQ(listener->take(1000).text, "a:queued#3 ");
  EXPECT_EQ(events.listen({}, number(0))->take(1000).text, "a:queued#1 b:queued#2 a:queued#3 ");
}

TEST_F(EventsTest, ReportsMissedEventsAfterANumberThatIsNotKept) {
  for (int i = 0; i < 6; ++i) events.on_state_changed("a", JobState::queued);  // two more than are kept
  EXPECT_TRUE(events.listen({}, number(1))->missed());
  EXPECT_FALSE(events.listen({}, number(2))->missed());
  EXPECT_TRUE(events.listen({}, number(7))->missed());
  EXPECT_TRUE(events.listen({}, -1)->missed());
  EXPECT_FALSE(events.listen({}, {})->missed());
}

TEST_F(EventsTest, MissedEventsDoNotCountAsSlowness) {
  for (int i = 0; i < 4; ++i) events.on_state_changed("a", JobState::queued);
  const auto listener = events.listen({}, number(0));
  events.on_state_changed("a", JobState::running);
  EXPECT_FALSE(listener->take(1).over);
}

TEST_F(EventsTest, EndedByComparesTheNumberOfTheEnd) {
  events.on_state_changed("a", JobState::succeeded);
  events.on_state_changed("b", JobState::queued);
  EXPECT_FALSE(events.ended_by("a", number(0)));
  EXPECT_TRUE(events.ended_by("a", number(1)));
  EXPECT_TRUE(events.ended_by("a", number(2)));
  EXPECT_FALSE(events.ended_by("a", number(3))) << "no number of ours";
  EXPECT_FALSE(events.ended_by("b", number(2)));
}

TEST(Events, DeliversEachEventOnceBetweenThreads) {
  constexpr int publishers = 4, each = 500;
  Events events(written, [] { return start_ms; }, {.untaken_max = publishers * each});
  std::atomic<int> received = 0;
  const auto listener = events.listen({}, {});
  std::atomic<bool> woken = false;
  listener->on_news([&] { woken = true; });
  in_threads(publishers, [&](int publisher) {
    const std::string id = std::to_string(publisher);
    for (int i = 0; i < each; ++i) {
      const auto passing = events.listen(id, {});
      events.on_state_changed(id, JobState::queued);
      if (passing->take(1000).text.starts_with(id + ":queued#")) ++received;
    }
  });
  EXPECT_EQ(received, publishers * each);
  EXPECT_EQ(events.listeners(), 1U);
  EXPECT_TRUE(woken);
  std::set<std::string> all;
  for (std::string one = listener->take(1).text; !one.empty(); one = listener->take(1).text) all.insert(one);
  EXPECT_EQ(all.size(), static_cast<std::size_t>(publishers * each));
}

TEST_F(EventsTest, LimitsTheNumberOfListeners) {
  auto first = events.listen("a", {});
  const auto second = events.listen("a", {}), third = events.listen({}, {});
  EXPECT_EQ(events.listen("b", {}), nullptr);
  first.reset();
  EXPECT_EQ(events.listeners(), 2U);
  EXPECT_NE(events.listen("b", {}), nullptr);
  events.on_state_changed("a", JobState::queued);
  EXPECT_EQ(second->take(1000).text, "a:queued#1 ");
}

}  // namespace
