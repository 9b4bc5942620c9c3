/// The contract of claims and lists: their order, and concurrent calls.

#include <atomic>
#include <map>
#include <set>

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

constexpr int thread_count = 8;

}  // namespace

TEST_P(JobStoreConformance, ClaimsTheHighestPriorityFirstThenTheOldest) {
  const std::string normal_old = submit(), normal_new = submit();
  const std::string high_old = submit([](Job& job) { job.priority = 90; });
  const std::string low = submit([](Job& job) { job.priority = 0; });
  const std::string high_new = submit([](Job& job) { job.priority = 90; });
  for (const std::string& expected : {high_old, high_new, normal_old, normal_new, low}) {
    EXPECT_EQ(claim().job.id, expected);
  }
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
}

TEST_P(JobStoreConformance, AReleasedJobKeepsItsPosition) {
  const std::string first = submit();
  submit();
  const Claim claimed = claim();
  store().release(claimed.job.id, claimed.fence, now, {});
  EXPECT_EQ(claim().job.id, first);
}

TEST_P(JobStoreConformance, EightThreadsClaimEachJobExactlyOnce) {
  std::set<std::string> submitted;
  for (int i = 0; i < 200; ++i) submitted.insert(submit());
  std::mutex mutex;
  std::map<std::string, int> claims;
  const auto nodes = this->nodes();
  in_threads(thread_count, [&](int thread) {
    while (const std::optional<Claim> claimed = nodes[thread % 2]->claim("boot", now, lease_end, false)) {
      const std::lock_guard lock(mutex);
      ++claims[claimed->job.id];
    }
  });
  EXPECT_EQ(claims.size(), submitted.size());
  for (const auto& [id, times] : claims) EXPECT_EQ(times, 1) << id;
}

TEST_P(JobStoreConformance, AcceptsOneOfManyConcurrentEnds) {
  for (int round = 0; round < 20; ++round) {
    const Placed job = place(JobState::running);
    std::atomic<int> winners = 0;
    in_threads(thread_count, [&](int thread) {
      const bool won = thread % 2 == 0 ? store().succeed(job.id, job.fence, now, "{}", {})
                                       : store().release(job.id, job.fence, now, {.counts = true, .suspect = false});
      winners += won ? 1 : 0;
    });
    EXPECT_EQ(winners, 1);
    store().remove(job.id);
  }
}

TEST_P(JobStoreConformance, LosesNothingUnderConcurrentCalls) {
  std::atomic<int> finished = 0, unseen = 0;
  const auto nodes = this->nodes();
  const auto claim_and_succeed = [&](StoreCalls& node) {
    const auto claimed = node.claim("boot", now, lease_end, false);
    return claimed && node.succeed(claimed->job.id, claimed->fence, now, "{}", {});
  };
  in_threads(thread_count, [&](int thread) {
    for (int i = 0; i < 25; ++i) {
      Job job;
      job.id = "job-" + std::to_string(thread) + "-" + std::to_string(100 + i);
      job.labels = {{"thread", std::to_string(thread)}};
      nodes[thread % 2]->submit(job, job.id);
      if (store().document(job.id) != job.id) ++unseen;  // acknowledged jobs are visible to every reader
      finished += claim_and_succeed(*nodes[thread % 2]) ? 1 : 0;
    }
  });
  // In a shared database a claim finds none if others took all jobs that were there when it began. A later one remains.
  while (claim_and_succeed(store())) ++finished;
  EXPECT_EQ(unseen, 0);
  EXPECT_EQ(finished, thread_count * 25);
  EXPECT_EQ(store().count(JobState::succeeded), thread_count * 25);
  EXPECT_EQ(list({.state = {}, .labels = {{"thread", "3"}}, .batch = {}, .text = {}}).size(), 25u);
}

TEST_P(JobStoreConformance, ListsNewestFirstInDisjointCompletePages) {
  std::vector<std::string> newest_first;
  for (int i = 0; i < 23; ++i) newest_first.insert(newest_first.begin(), submit());
  for (const int limit : {1, 5, 22, 23, 24}) EXPECT_EQ(list({}, limit), newest_first) << "pages of " << limit;
  EXPECT_EQ(store().list({}, "", 23).next_cursor, "") << "a full page at the end has no next";
  const std::string cursor = store().list({}, "", 22).next_cursor;
  EXPECT_EQ(cursor, newest_first[21]);
  submit();
  const JobPage last = store().list({}, cursor, 22);
  ASSERT_EQ(last.items.size(), 1u) << "newer jobs move no page";
  EXPECT_EQ(last.items[0].id, newest_first[22]);
}

TEST_P(JobStoreConformance, ListsJobsThatMatchStateLabelsAndText) {
  using Labels = std::map<std::string, std::string>;
  const auto with = [&](const std::string& name, const Labels& labels) {
    return submit([&](Job& job) { job.name = name, job.labels = labels; });
  };
  const std::string a = with("red sphere", {{"batch", "1"}, {"user", "ann"}});
  const std::string b = with("red plane", {{"batch", "1"}, {"user", "bob"}});
  const std::string c = with("Red sphere", {{"batch", "2"}, {"user", "ann"}});
  const std::string d = with("100% sphere_", {});
  store().cancel(b, now);
  using Ids = std::vector<std::string>;
  const std::vector<std::tuple<JobFilter, Ids>> table = {
      {{{}, {}, {}, ""}, {d, c, b, a}},
      {{JobState::queued, {}, {}, ""}, {d, c, a}},
      {{JobState::cancelled, {}, {}, ""}, {b}},
      {{JobState::failed, {}, {}, ""}, {}},
      {{{}, {{"batch", "1"}}, {}, ""}, {b, a}},
      {{{}, {{"batch", "1"}, {"user", "ann"}}, {}, ""}, {a}},
      {{{}, {{"batch", "1"}, {"user", "none"}}, {}, ""}, {}},
      {{{}, {{"nothing", "1"}}, {}, ""}, {}},
      {{JobState::queued, {{"batch", "1"}}, {}, ""}, {a}},
      {{{}, {}, {}, "red"}, {c, b, a}},
      {{{}, {}, {}, "sphere"}, {d, c, a}},
      {{{}, {}, {}, "% s"}, {d}},
      {{{}, {}, {}, "e_"}, {d}},
      {{JobState::queued, {{"user", "ann"}}, {}, "ed sph"}, {c, a}},
  };
  for (const auto& [filter, expected] : table) {
    for (const int limit : {1, 2, 100}) {
      EXPECT_EQ(list(filter, limit), expected)
          << (filter.state ? name_of(*filter.state) : "any") << ", " << filter.labels.size() << " labels, \""
          << filter.text << "\", pages of " << limit;
    }
  }
}

TEST_P(JobStoreConformance, RecoversTheRunningJobsOfADeadDaemon) {
  const std::string running = submit(), cancelling = submit(), waiting = submit();
  const Claim stale = claim();
  claim();
  store().cancel(cancelling, now);
  reopen();
  EXPECT_EQ(store().recover("boot", now), 0) << "its own";
  EXPECT_EQ(store().recover("next boot", now + 7), is_shared() ? 0 : 2);
  if (is_shared()) return;  // leases end in time
  const Job recovered = find(running);
  EXPECT_EQ(recovered.state, JobState::queued);
  EXPECT_EQ(recovered.attempt, 0) << "the daemon's death is not the job's fault";
  EXPECT_FALSE(recovered.suspect);
  const Job cancelled = find(cancelling);
  EXPECT_EQ(cancelled.state, JobState::cancelled);
  EXPECT_EQ(cancelled.ended_at, now + 7);
  EXPECT_EQ(find(waiting).state, JobState::queued);
  EXPECT_FALSE(store().succeed(running, stale.fence, now, "late", {}));
  EXPECT_EQ(claim().job.id, running);
  EXPECT_EQ(claim().job.id, waiting);
}
