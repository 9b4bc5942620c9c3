/// Tasks of one image that nodes share through PostgreSQL.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/storage/postgres/postgres_stores.h"
#include "tests/conformance/test_store.h"
#include "tests/support/postgres_server.h"

using namespace queue;
using storage::postgres::PostgresStores;

namespace {

class TaskStoreTest : public PostgresTest {
 protected:
  TaskStoreTest() {
    StoreCalls calls(first.all());
    calls.submit(job_named(job_id), "{}");
    fence = calls.claim("boot", 1, 1'000'000'000'000'000, false)->fence;
  }

  static std::string key(int number) { return std::string(63, 'a') + static_cast<char>('0' + number); }
  void publish(int count) {
    std::vector<NewTask> tasks;
    for (int i = 0; i < count; ++i) tasks.push_back({key(i), "part " + std::to_string(i) + '\0'});
    one.publish(job_id, tasks);
  }
  void end_leases() { server.sql(uri, "UPDATE tasks SET lease_until = 0"); }

  PostgresStores first{uri, {.node = "one", .build = "b"}}, second{uri, {.node = "two", .build = "b"}},
      third{uri, {.node = "three", .build = "other"}};
  TaskStore &one = first.tasks(), &two = second.tasks();
  const std::string job_id = numbered_id(1);
  std::int64_t fence = 0;
};

}  // namespace

TEST_F(TaskStoreTest, GivesEachTaskToOneNode) {
  publish(3);
  EXPECT_EQ(one.claim_own(job_id)->key, key(0));
  const auto last = two.claim_other("");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->key, key(2));
  EXPECT_EQ(last->part, std::string("part 2") + '\0');
  EXPECT_EQ(last->job_id, job_id);
  EXPECT_EQ(two.claim_other("")->key, key(1));
  EXPECT_FALSE(two.claim_other(""));
  EXPECT_FALSE(one.claim_own(job_id));
}

TEST_F(TaskStoreTest, GivesTasksToOtherNodesOfTheSameBuildOnly) {
  publish(2);
  EXPECT_FALSE(one.claim_other("")) << "its own job";
  EXPECT_FALSE(third.tasks().claim_other("")) << "another build";
  EXPECT_FALSE(two.claim_other("x " + job_id + " ")) << "excluded";
  EXPECT_TRUE(two.claim_other("x "));
  two.register_helper();
  third.tasks().register_helper();
  EXPECT_EQ(one.helpers(), 1);
  EXPECT_EQ(two.helpers(), 0);
}

TEST_F(TaskStoreTest, KeepsResultsUntilTheJobEnds) {
  publish(2);
  const std::string result("\0result", 7);
  const TaskClaim claim = *two.claim_other("");
  EXPECT_TRUE(two.finish(claim, result));
  EXPECT_FALSE(two.finish(claim, "again"));
  EXPECT_EQ(one.finished(job_id), std::vector{claim.key});
  const auto outcome = one.outcome(job_id, claim.key);
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->result, result);
  EXPECT_EQ(outcome->node, "two");
  EXPECT_EQ(outcome->attempt, 1);
  EXPECT_FALSE(one.outcome(job_id, key(0)));
  two.publish(job_id, {{claim.key, "part"}});  // the next attempt of the job runs on another node
  EXPECT_EQ(two.finished(job_id), std::vector{claim.key});
  EXPECT_TRUE(StoreCalls(first.all()).fail(job_id, fence, 5, {"internal", "", {}}));
  EXPECT_TRUE(one.finished(job_id).empty());
  EXPECT_FALSE(two.claim_other(""));
}

TEST_F(TaskStoreTest, GivesATaskAgainWhenItsLeaseHasEnded) {
  publish(1);
  const TaskClaim lost = *two.claim_other("");
  EXPECT_FALSE(one.claim_own(job_id));
  end_leases();
  two.renew();
  EXPECT_FALSE(one.claim_own(job_id)) << "renewed";
  end_leases();
  const auto again = one.claim_own(job_id);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->attempt, 2);
  EXPECT_FALSE(two.finish(lost, "late"));
  two.release(lost);
  EXPECT_FALSE(two.claim_other("")) << "a release of an older claim changes nothing";
  EXPECT_TRUE(one.finish(*again, "result"));
}

TEST_F(TaskStoreTest, GivesAReleasedTaskAtOnce) {
  publish(1);
  two.release(*two.claim_other(""));
  EXPECT_EQ(one.claim_own(job_id)->attempt, 2);
  publish(1);  // the next attempt on the same node: its claims are void
  EXPECT_EQ(one.claim_own(job_id)->attempt, 3);
}
