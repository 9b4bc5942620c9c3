/// Attempts that fail, take too long or use too much memory: retries, stops and problems.

#include "tests/queue/supervised.h"

using queue::JobState;

namespace {

std::vector<std::int64_t> pauses_ms(const std::string& code, int max_attempts) {
  const worker::RetrySettings settings{std::chrono::milliseconds(10), std::chrono::milliseconds(100)};
  std::vector<std::int64_t> pauses;
  for (int attempt = 1;; ++attempt) {
    const auto pause = worker::retry_pause(code, attempt, max_attempts, settings);
    if (!pause) return pauses;
    pauses.push_back(pause->count());
  }
}

}  // namespace

TEST(RetryRules, PausesGrowFourfoldUpToTheMaximum) {
  for (const char* code : {"out_of_memory", "timed_out", "worker_crashed", "internal"}) {
    EXPECT_EQ(pauses_ms(code, 5), (std::vector<std::int64_t>{10, 40, 100, 100})) << code;
    EXPECT_TRUE(pauses_ms(code, 1).empty()) << code;
  }
}

TEST(RetryRules, DoesNotRetryFailuresThatTheJobCauses) {
  for (const char* code : {"bad_scene", "bad_asset", "deadline_exceeded", ""}) {
    EXPECT_TRUE(pauses_ms(code, 5).empty()) << code;
  }
}

TEST_F(SupervisorTest, RetriesTransientFailures) {
  start();
  for (const std::string code : {"internal", "out_of_memory"}) {
    const std::string id = submit("fail_unless " + path(code) + " " + code + "\nfinish done");
    ASSERT_TRUE(reaches(id, JobState::succeeded)) << code;
    EXPECT_EQ(find(id).attempt, 2) << code;
    EXPECT_EQ(find(id).suspect, code == "out_of_memory") << "it runs alone";
  }
  EXPECT_EQ(log.count("attempt_failed"), 2);
}

TEST_F(SupervisorTest, WaitsBeforeTheNextAttempt) {
  start([](auto& with) { with.retry.pause = with.retry.pause_max = std::chrono::hours(1); });
  const std::string id = submit("fail internal");
  ASSERT_TRUE(eventually([&] { return find(id).not_before.has_value(); }));
  EXPECT_EQ(state(id), JobState::queued);
  EXPECT_GT(*find(id).not_before, *find(id).started_at + 3'590'000);
}

TEST_F(SupervisorTest, StopsAnAttemptThatTakesTooLong) {
  start([](auto& with) { with.wall_time = std::chrono::milliseconds(50); });
  const std::string id = submit("wait " + path("never"), 2);
  expect_failure(id, "timed_out", 2);
  EXPECT_EQ(log.count("worker_started"), 1) << "it stopped";
}

TEST_F(SupervisorTest, ReplacesTheWorkerInEachAttemptOfAHangingJob) {
  start([](auto& with) { with.wall_time = with.cancel_grace = std::chrono::milliseconds(50); }, impatient());
  const std::string id = submit("hang " + path("never"), 2);
  expect_failure(id, "timed_out", 2);
  EXPECT_TRUE(eventually([&] { return log.count("worker_ended") == 2; }));
  EXPECT_TRUE(reaches(submit("", 100), JobState::succeeded));
}

TEST_F(SupervisorTest, StopsAJobAtItsDeadlineWithoutRetry) {
  start();
  const std::string id = overrun("wait " + path("never"));
  expect_failure(id, "deadline_exceeded", 1);
}

TEST_F(SupervisorTest, ReplacesAWorkerThatDoesNotStopAnOverdueJobAtNoCostOfOthers) {
  start([](auto& with) { with.cancel_grace = std::chrono::milliseconds(50); }, impatient());
  const std::string innocent = submit("wait " + path("go"), 1);
  ASSERT_TRUE(reaches(innocent, JobState::running));
  const std::string hang = overrun("hang " + path("never"));
  ASSERT_TRUE(eventually([&] { return log.count("worker_ended") >= 1; }));
  create("go");
  EXPECT_TRUE(reaches(innocent, JobState::succeeded));
  EXPECT_EQ(problem_code(hang), "deadline_exceeded");
}

TEST_F(SupervisorTest, DelaysARetryUntilTheLastAttemptHasStopped) {
  start(impatient());
  const std::string id = submit("hang " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  queue.lifecycle.cancel(id);
  ASSERT_TRUE(reaches(id, JobState::cancelled));
  EXPECT_EQ(queue.lifecycle.retry(id), queue::RetryOutcome::queued);
  ASSERT_TRUE(eventually([&] { return log.count("job_released") >= 2; }));
  EXPECT_EQ(supervisor->running(), 1);
  create("go");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).attempt, 1);
}

TEST_F(SupervisorTest, FailsTheJobThatUsesTooMuchMemory) {
  start([](auto& with) { with.job_memory_bytes = 64u << 20; });
  const std::string innocent = submit("wait " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  const std::string greedy = submit("fill 400000000 " + path("never"), 2);
  ASSERT_TRUE(eventually([&] { return log.count("worker_ended") >= 1; }));
  create("go");
  expect_failure(greedy, "out_of_memory", 2, "job_memory_bytes of 67108864");
  EXPECT_TRUE(reaches(innocent, JobState::succeeded));
  EXPECT_EQ(find(innocent).attempt, 1);
}
