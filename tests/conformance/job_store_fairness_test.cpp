/// The contract of claims of jobs of several owners: turns, weights, limits and positions.

#include <map>

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

/// Submits for an owner.
struct Owner {
  std::string name;
  int weight = 1;
  void operator()(Job& job) const { job.owner = name, job.weight = weight; }
};

const Owner ann{"ann"}, bob{"bob"}, eve{"eve"};

}  // namespace

TEST_P(JobStoreConformance, ClaimsOwnersInTurn) {
  std::vector<std::string> of_ann;
  for (int i = 0; i < 4; ++i) of_ann.push_back(submit(ann));
  const std::string of_bob = submit(bob), of_eve = submit(eve), second_of_bob = submit(bob);
  for (const std::string& expected : {of_ann[0], of_bob, of_eve, of_ann[1], second_of_bob, of_ann[2], of_ann[3]}) {
    EXPECT_EQ(claim().job.id, expected);
  }
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
}

TEST_P(JobStoreConformance, ClaimsFirstForTheOwnerWithTheFewestRunningJobs) {
  for (int i = 0; i < 5; ++i) submit(ann);
  for (int i = 0; i < 3; ++i) claim();
  const std::string first = submit(bob), second = submit(bob);
  const Claim of_bob = claim();
  EXPECT_EQ(of_bob.job.id, first) << "bob has no running job";
  EXPECT_EQ(claim().job.id, second) << "bob has one, ann three";
  store().succeed(first, of_bob.fence, now, "{}", {});
  const std::string third = submit(bob);
  EXPECT_EQ(claim().job.id, third);
}

TEST_P(JobStoreConformance, ThePriorityOrdersTheJobsOfOneOwnerAlone) {
  const std::string low = submit([](Job& job) { ann(job), job.priority = 0; });
  const std::string high = submit([](Job& job) { ann(job), job.priority = 100; });
  const std::string of_bob = submit([](Job& job) { bob(job), job.priority = 0; });
  for (const std::string& expected : {high, of_bob, low}) EXPECT_EQ(claim().job.id, expected);
}

TEST_P(JobStoreConformance, WeightsTheTurnsOfOwners) {
  const Owner heavy{"heavy", 3};
  for (int i = 0; i < 40; ++i) submit(ann), submit(heavy);
  std::map<std::string, int> turns;
  for (int i = 0; i < 40; ++i) ++turns[succeed_next().owner];
  EXPECT_EQ(turns, (std::map<std::string, int>{{"ann", 10}, {"heavy", 30}}));
}

TEST_P(JobStoreConformance, WeightsTheRunningJobsOfOwners) {
  const Owner heavy{"heavy", 3};
  for (int i = 0; i < 8; ++i) submit(ann), submit(heavy);
  std::map<std::string, int> running;
  for (int i = 0; i < 8; ++i) ++running[claim().job.owner];
  EXPECT_EQ(running, (std::map<std::string, int>{{"ann", 2}, {"heavy", 6}}));
}

TEST_P(JobStoreConformance, IdleOwnersGetNoCredit) {
  for (int i = 0; i < 30; ++i) submit(ann);
  for (int i = 0; i < 20; ++i) succeed_next();
  for (int i = 0; i < 10; ++i) submit(bob);
  std::string owners;
  for (int i = 0; i < 6; ++i) owners += succeed_next().owner + " ";
  EXPECT_TRUE(owners == "bob ann bob ann bob ann " || owners == "ann bob ann bob ann bob ") << owners;
}

TEST_P(JobStoreConformance, TurnsSurviveARestart) {
  submit(ann), submit(ann), submit(bob);
  EXPECT_EQ(succeed_next().owner, "ann");
  reopen();
  EXPECT_EQ(claim().job.owner, "bob");
}

TEST_P(JobStoreConformance, ClaimsNothingForBusyOwners) {
  const std::string of_ann = submit(ann), of_bob = submit(bob), nameless = submit();
  const auto claim_without = [&](const std::vector<std::string>& owners) {
    const auto claimed = store().claim({"boot", lease_end}, now, {.busy_owners = owners});
    return claimed ? claimed->job.id : std::string();
  };
  EXPECT_EQ(claim_without({"ann", "bob", ""}), "");
  EXPECT_EQ(claim_without({"ann", "eve", ""}), of_bob);
  EXPECT_EQ(claim_without({"an", "nn", "ann"}), nameless);
  EXPECT_EQ(claim_without({""}), of_ann);
}

TEST_P(JobStoreConformance, ReportsTheLastJobThatCanBeClaimed) {
  submit(ann), submit(ann), submit(bob);
  const auto is_last = [&](const ClaimFilter& filter) {
    return store().claim({"boot", lease_end}, now, filter).value().is_last;
  };
  EXPECT_FALSE(is_last({}));
  EXPECT_EQ(is_last({.busy_owners = {"ann"}}), !is_shared()) << "another process may give back a job";
  EXPECT_EQ(is_last({}), !is_shared());
}

TEST_P(JobStoreConformance, AJobReleasedAsLargeIsNoSmallOneAnyMore) {
  const Placed job = place(JobState::running);
  EXPECT_TRUE(store().release(job.id, job.fence, now, {.large = true}));
  EXPECT_TRUE(find(job.id).large);
  EXPECT_EQ(find(job.id).attempt, 0);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false, true));
  const Claim again = claim();
  EXPECT_EQ(again.job.id, job.id);
  store().release(job.id, again.fence, now, {});
  EXPECT_TRUE(find(job.id).large) << "it stays";
}

/// The order in which the jobs are really claimed is the oracle.
TEST_P(JobStoreConformance, ReportsPositionsAmongOwners) {
  const Owner heavy{"heavy", 3};
  std::vector<std::string> ids;
  for (int i = 0; i < 7; ++i) ids.push_back(submit(ann));
  for (int i = 0; i < 3; ++i) ids.push_back(submit(bob)), ids.push_back(submit(heavy));
  for (int i = 0; i < 6; ++i) {
    ids.push_back(submit([&](Job& job) { heavy(job), job.priority = 10 * i; }));
    ids.push_back(submit([&](Job& job) { eve(job), job.priority = 100 - i; }));
    if (i % 2 != 0) continue;
    std::erase(ids, succeed_next().id);  // owners have different numbers of turns behind them
  }
  std::map<std::int64_t, std::string> expected;
  for (const std::string& id : ids) expected[store().queue_position(id, 100).value()] = id;
  ASSERT_EQ(expected.size(), ids.size()) << "each position occurs once";
  for (const auto& [position, id] : expected) {
    EXPECT_EQ(store().queue_position(id, 5), std::min<std::int64_t>(store().queue_position(id, 100).value(), 5));
    EXPECT_EQ(succeed_next().id, id) << position;
  }
}

TEST_P(JobStoreConformance, SumsTheWorkOfTheJobsBeforeAnother) {
  std::vector<std::string> ids;
  std::map<std::string, std::int64_t> work;
  const auto add = [&](const Owner& owner, std::int64_t rays) {
    ids.push_back(submit([&](Job& job) { owner(job), job.work = rays; }));
    work[ids.back()] = rays;
  };
  for (int i = 0; i < 4; ++i) add(ann, 1 << i), add(bob, 100 << i), add(Owner{"heavy", 3}, 10'000 << i);
  std::map<std::int64_t, std::string> in_order;
  for (const std::string& id : ids) in_order[store().queue_position(id, 100).value()] = id;
  ASSERT_EQ(in_order.size(), ids.size());
  std::int64_t before = 0;
  for (const auto& [position, id] : in_order) {
    EXPECT_EQ(store().work_before(id), before) << position;
    before += work[id];
  }
  EXPECT_EQ(store().depth().work, before);
  submit([&](Job& job) { job.work = 7, job.not_before = now + 1; });
  EXPECT_EQ(store().depth().work, before) << "it may not run yet";
  const std::string& first = in_order.begin()->second;
  const Claim claimed = claim();
  EXPECT_EQ(claimed.job.work, work[first]);
  EXPECT_EQ(store().depth().work, before - work[first]);
  store().release(first, claimed.fence, now, {});
  EXPECT_EQ(store().depth().work, before);
  store().remove(first);
  EXPECT_EQ(store().depth().work, before - work[first]);
}
