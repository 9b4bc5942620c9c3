/// The contract of transitions: the effect of each call on a job in each state.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

constexpr JobState all_states[] = {JobState::queued, JobState::running, JobState::succeeded, JobState::failed,
                                   JobState::cancelled};

/// Ends the job of an id and a fence.
using End = std::function<bool(const std::string&, std::int64_t)>;

}  // namespace

TEST(JobMoves, MatchTheTransitionTable) {
  const std::vector<std::pair<std::string, std::string>> table = {
      {"queued", "running"},    {"queued", "failed"},    {"queued", "cancelled"},  {"running", "queued"},
      {"running", "succeeded"}, {"running", "failed"},   {"running", "cancelled"}, {"failed", "queued"},
      {"cancelled", "queued"},  {"succeeded", "queued"},
  };
  for (const JobState from : all_states) {
    for (const JobState to : all_states) {
      const bool listed =
          std::count(table.begin(), table.end(), std::pair<std::string, std::string>{name_of(from), name_of(to)}) == 1;
      EXPECT_EQ(may_move(from, to), listed) << name_of(from) << " to " << name_of(to);
    }
  }
}

TEST(JobMoves, UseTheStateNamesOfTheContract) {
  for (const JobState state : all_states) EXPECT_EQ(job_state(name_of(state)), state);
  EXPECT_FALSE(job_state("Running"));
  EXPECT_FALSE(job_state(""));
}

TEST_P(JobStoreConformance, ClaimingMovesAQueuedJobToRunningAndCountsTheAttempt) {
  const std::string id = submit();
  now = 2'000'000;
  const Job claimed = claim().job;
  EXPECT_EQ(claimed, find(id));
  EXPECT_EQ(claimed.state, JobState::running);
  EXPECT_EQ(claimed.attempt, 1);
  EXPECT_EQ(claimed.started_at, 2'000'000);
}

TEST_P(JobStoreConformance, OnlyARunningJobWithTheLatestFenceCanEnd) {
  const std::vector<std::pair<JobState, End>> ends = {
      {JobState::succeeded, [&](auto id, auto fence) { return store().succeed(id, fence, now + 1, "{}", {}); }},
      {JobState::failed,
       [&](auto id, auto fence) {
         return store().fail(id, fence, now + 1, {"internal", "x", {}});
       }},
      {JobState::cancelled, [&](auto id, auto fence) { return store().finish_cancel(id, fence, now + 1); }},
  };
  for (const auto& [to, end] : ends) {
    for (const JobState from : all_states) {
      const Placed job = place(from);
      const bool may = from == JobState::running;
      EXPECT_FALSE(end(job.id, job.fence + 1)) << "wrong fence, " << name_of(from) << " to " << name_of(to);
      EXPECT_EQ(find(job.id).state, from);
      EXPECT_EQ(end(job.id, job.fence), may) << name_of(from) << " to " << name_of(to);
      const Job found = find(job.id);
      EXPECT_EQ(found.state, may ? to : from);
      EXPECT_EQ(found.ended_at == now + 1, may);
      EXPECT_FALSE(end(job.id, job.fence)) << "twice, " << name_of(from) << " to " << name_of(to);
      store().remove(job.id);
    }
  }
}

TEST_P(JobStoreConformance, ReleasesOnlyARunningJob) {
  for (const JobState from : all_states) {
    const Placed job = place(from);
    const bool may = from == JobState::running;
    EXPECT_EQ(store().release(job.id, job.fence, now, {.counts = true, .suspect = false}), may) << name_of(from);
    EXPECT_EQ(find(job.id).state, may ? JobState::queued : from);
    store().remove(job.id);
  }
}

TEST_P(JobStoreConformance, CancelsInEveryState) {
  const std::vector<std::tuple<JobState, CancelOutcome, JobState>> table = {
      {JobState::queued, CancelOutcome::cancelled, JobState::cancelled},
      {JobState::succeeded, CancelOutcome::already_ended, JobState::succeeded},
      {JobState::failed, CancelOutcome::already_ended, JobState::failed},
      {JobState::cancelled, CancelOutcome::already_ended, JobState::cancelled},
      {JobState::running, CancelOutcome::cancelling, JobState::running},
  };
  for (const auto& [from, outcome, after] : table) {
    const Placed job = place(from);
    EXPECT_EQ(store().cancel(job.id, now + 9), outcome) << name_of(from);
    const Job found = find(job.id);
    EXPECT_EQ(found.state, after) << name_of(from);
    EXPECT_EQ(found.cancel_requested, from == JobState::running) << name_of(from);
    EXPECT_EQ(found.ended_at == now + 9, from == JobState::queued);
    EXPECT_FALSE(store().claim("boot", now, lease_end, false)) << name_of(from);
    store().remove(job.id);
  }
}

TEST_P(JobStoreConformance, EndsAJobWhoseCancelWasRequested) {
  const std::vector<std::pair<JobState, End>> ends = {
      {JobState::cancelled, [&](auto id, auto fence) { return store().finish_cancel(id, fence, now + 3); }},
      {JobState::succeeded, [&](auto id, auto fence) { return store().succeed(id, fence, now + 3, "{}", {}); }},
      {JobState::cancelled,
       [&](auto id, auto fence) { return store().release(id, fence, now + 3, {.suspect = true}); }},
  };
  for (const auto& [state, end] : ends) {
    const Placed job = place(JobState::running);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(store().cancel(job.id, now), CancelOutcome::cancelling);
    EXPECT_TRUE(end(job.id, job.fence));
    const Job found = find(job.id);
    EXPECT_EQ(found.state, state);
    EXPECT_EQ(found.ended_at, now + 3);
    EXPECT_FALSE(found.cancel_requested);
    EXPECT_FALSE(store().claim("boot", now, lease_end, true));
  }
}

TEST_P(JobStoreConformance, ReleaseKeepsTheAttemptOnlyWhenItCounts) {
  const Placed job = place(JobState::running);
  EXPECT_TRUE(store().release(job.id, job.fence, now, {.counts = true, .suspect = false}));
  EXPECT_EQ(find(job.id).attempt, 1);
  const Claim second = claim();
  EXPECT_EQ(second.job.attempt, 2);
  EXPECT_TRUE(store().release(job.id, second.fence, now, {}));
  EXPECT_EQ(find(job.id).attempt, 1);
  EXPECT_EQ(claim().job.attempt, 2);
}

TEST_P(JobStoreConformance, ClaimsSuspectsSeparatelyUntilTheyEnd) {
  const Placed suspect = place(JobState::running);
  EXPECT_TRUE(store().release(suspect.id, suspect.fence, now, {.counts = false, .suspect = true}));
  reopen();
  store().recover("next boot", now);
  const std::string other = submit();
  EXPECT_EQ(claim(false).job.id, other);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false)) << "a suspect never runs with others";
  const Claim first = claim(true);
  EXPECT_EQ(first.job.id, suspect.id);
  EXPECT_TRUE(first.job.suspect);
  store().release(suspect.id, first.fence, now, {.counts = true, .suspect = false});
  EXPECT_EQ(claim(true).job.id, suspect.id);
  EXPECT_FALSE(store().claim("boot", now, lease_end, true));
}
