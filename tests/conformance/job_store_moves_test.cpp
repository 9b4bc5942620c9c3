/// The contract of transitions: the effect of each call on a job in each state.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;
using namespace storage::sqlite;

namespace {

constexpr JobState all_states[] = {JobState::queued, JobState::running, JobState::succeeded, JobState::failed,
                                   JobState::cancelled};

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

TEST_P(JobStoreConformance, ANewJobThatIsClaimedAtOnceEqualsOneThatIsClaimedLater) {
  const auto insert = [&](bool keep) {
    Job job = new_job();
    job.keep = keep;
    return store().insert_and_claim({.jobs = {{job, "{}"}}, .claim = ClaimTerms{"boot", lease_end}}, now).value();
  };
  const Claim at_once = insert(true);
  EXPECT_EQ(at_once.is_last, !is_shared());
  EXPECT_EQ(store().count(JobState::queued), 0);
  submit();
  const Claim later = claim();
  EXPECT_EQ(later.fence, at_once.fence);
  EXPECT_EQ(store().count(JobState::running), 2);
  for (const Claim& claimed : {at_once, later}) {
    const Job found = find(claimed.job.id);
    for (const Job& job : {claimed.job, found}) {
      EXPECT_EQ(job.state, JobState::running);
      EXPECT_EQ(job.started_at, now);
      EXPECT_EQ(std::pair(job.attempt, job.revision), std::pair(later.job.attempt, later.job.revision));
    }
    const std::vector<JobMove> moves = store().moves(found.id);
    ASSERT_EQ(moves.size(), 1u);
    EXPECT_EQ(std::tuple(moves[0].at, moves[0].state, moves[0].attempt, moves[0].worker),
              std::tuple(now, JobState::running, 1, "boot"));
    EXPECT_TRUE(store().renew({{found.id, claimed.fence}}, lease_end + 1).empty());
    EXPECT_TRUE(store().succeed(found.id, claimed.fence, now, "{}", {}));
  }
  EXPECT_EQ(store().count(JobState::running), 0);
  EXPECT_TRUE(store().moves(insert(false).job.id).empty());
}

TEST_P(JobStoreConformance, ANewJobWaitsBehindOthersAndIsNotClaimedAfterItsDeadline) {
  Job late = new_job();
  late.deadline = now;
  EXPECT_FALSE(store().insert_and_claim({.jobs = {{late, "{}"}}, .claim = ClaimTerms{"boot", lease_end}}, now));
  EXPECT_EQ(find(late.id).state, JobState::queued);
  const std::string first = submit();
  const Job second = new_job();
  EXPECT_FALSE(store().insert_and_claim({.jobs = {{second, "{}"}}, .claim = ClaimTerms{"boot", lease_end}}, now));
  EXPECT_EQ(claim().job.id, first);
  EXPECT_EQ(claim().job.id, second.id);
}

TEST_P(JobStoreConformance, OnlyARunningJobWithTheLatestFenceCanEnd) {
  using End = std::function<bool(const std::string&, std::int64_t)>;
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
    store().remove(job.id);
  }
}

TEST_P(JobStoreConformance, NeverClaimsAJobCancelledWhileQueued) {
  store().cancel(submit(), now);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
}

TEST_P(JobStoreConformance, CancellingARunningJobIsIdempotent) {
  const Placed job = place(JobState::running);
  EXPECT_EQ(store().cancel(job.id, now), CancelOutcome::cancelling);
  EXPECT_EQ(store().cancel(job.id, now), CancelOutcome::cancelling);
  EXPECT_TRUE(store().finish_cancel(job.id, job.fence, now));
  const Job found = find(job.id);
  EXPECT_EQ(found.state, JobState::cancelled);
  EXPECT_FALSE(found.cancel_requested);
}

TEST_P(JobStoreConformance, KeepsAResultThatPrecedesTheCancel) {
  const Placed job = place(JobState::running);
  store().cancel(job.id, now);
  EXPECT_TRUE(store().succeed(job.id, job.fence, now, "{}", {}));
  const Job found = find(job.id);
  EXPECT_EQ(found.state, JobState::succeeded);
  EXPECT_FALSE(found.cancel_requested);
}

TEST_P(JobStoreConformance, ReleasingAJobWhoseCancelWasRequestedCancelsIt) {
  const Placed job = place(JobState::running);
  store().cancel(job.id, now);
  EXPECT_TRUE(store().release(job.id, job.fence, now + 3, {.counts = false, .suspect = true}));
  const Job found = find(job.id);
  EXPECT_EQ(found.state, JobState::cancelled);
  EXPECT_EQ(found.ended_at, now + 3);
  EXPECT_FALSE(found.cancel_requested);
  EXPECT_FALSE(store().claim("boot", now, lease_end, true));
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
