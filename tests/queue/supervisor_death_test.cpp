/// Workers that crash, hang or violate the protocol: no job is lost, the cause is found, no other job is charged.

#include <chrono>
#include <csignal>
#include <utility>

#include "tests/queue/supervised.h"

using queue::JobState;

TEST_F(SupervisorTest, FailsAJobThatAlwaysCrashesTheWorkerWithTheSignal) {
  start();
  const std::string id = submit("crash", 3);
  expect_failure(id, "worker_crashed", 3, "signal 11 (SIGSEGV)");
  EXPECT_EQ(log.count("worker_ended"), 3);
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
}

TEST_F(SupervisorTest, FindsTheCrashingJobAmongSeveralAtNoCostOfTheOthers) {
  start(settings(4));
  std::vector<std::string> innocent;
  for (int i = 0; i < 3; ++i) innocent.push_back(submit("wait " + path("go")));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 3; }));
  const std::string crashing = submit("crash", 2);
  ASSERT_TRUE(eventually([&] { return log.count("worker_ended") >= 1; }));
  create("go");
  expect_failure(crashing, "worker_crashed", 2);
  for (const std::string& id : innocent) {
    ASSERT_TRUE(reaches(id, JobState::succeeded));
    EXPECT_EQ(find(id).attempt, 1) << "the crash is not counted";
    EXPECT_TRUE(find(id).suspect);
  }
  EXPECT_EQ(log.count("worker_ended"), 3) << "once with all in flight, twice with the crashing alone";
}

TEST_F(SupervisorTest, RunsSuspectsOneAtATimeBeforeAllOthers) {
  start(settings(3));
  std::vector<std::string> suspects;
  for (int i = 0; i < 2; ++i) suspects.push_back(submit("wait " + path("go")));
  const std::string crashing = submit("crash_unless " + path("crashed"));
  ASSERT_TRUE(eventually([&] { return log.count("worker_ended") == 1; }));
  const std::string later = submit("");
  ASSERT_TRUE(eventually([&] { return log.count("worker_ready") == 2 && supervisor->running() == 1; }));
  EXPECT_EQ(store.count(JobState::running), 1) << "with two slots free";
  EXPECT_EQ(state(later), JobState::queued);
  create("go");
  for (const std::string& id : {suspects[0], suspects[1], crashing, later})
    EXPECT_TRUE(reaches(id, JobState::succeeded));
}

TEST_F(SupervisorTest, RunsASuspectThatIsQueuedWhileAClaimFindsNone) {
  const std::string suspect = submit("");
  const queue::Claim claim = *queue.lifecycle.claim();
  std::promise<void> started;
  hooks.after_suspect_claim = [&] {  // the first claim after the start is of suspects
    started.get_future().wait();
    queue.lifecycle.release(suspect, claim.fence, {.suspect = true});
    // The supervisor looks for jobs before it sends a task: it has processed the notification before the claim ends.
    EXPECT_EQ(image_of(run_image_task("scale")), "image");
  };
  start();
  started.set_value();
  EXPECT_TRUE(reaches(suspect, JobState::succeeded));
}

TEST_F(SupervisorTest, RepeatsAnImageTaskWhoseWorkerIsEndedForACancelledJob) {
  start([](auto& with) { with.cancel_grace = std::chrono::milliseconds(50); });
  const std::string id = submit("hang " + path("never"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  auto result = run_image_task("unless " + path("received"));
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(path("received")); }));
  queue.lifecycle.cancel(id);
  EXPECT_EQ(image_of(std::move(result)), "image");
  EXPECT_EQ(log.count("worker_ready"), 2);
}

TEST_F(SupervisorTest, ReplacesAWorkerWithoutHeartbeat) {
  start([](auto& with) { with.heartbeat_timeout = std::chrono::seconds(3); });
  const std::string id = submit("wait " + path("never"), 1);
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  kill(supervisor->worker_pid(), SIGSTOP);
  expect_failure(id, "worker_crashed", 1, "sent no heartbeat");
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
}

TEST_F(SupervisorTest, ReplacesAWorkerThatViolatesTheProtocol) {
  start();
  for (const std::string violation : {"garbage", "badname", "descriptors"}) {
    SCOPED_TRACE(violation);
    expect_failure(submit(violation + "\nwait " + path("never"), 1), "worker_crashed", 1, " sent ");
  }
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
}

TEST_F(SupervisorTest, ReplacesAWorkerThatSendsAResultWithAnOldFence) {
  start();
  expect_failure(submit("stale\nfinish fresh", 1), "worker_crashed", 1, "answered a job that it does not run");
}

TEST_F(SupervisorTest, StoresAResultSentRightBeforeACrash) {
  start();
  for (int i = 1; i <= 10; ++i) {
    const std::string id = submit("finish_and_crash last result");
    ASSERT_TRUE(reaches(id, JobState::succeeded));
    EXPECT_EQ(find(id).attempt, 1);
    ASSERT_TRUE(eventually([&] { return log.count("worker_ended") == i; }));
  }
}

TEST_F(SupervisorTest, StoresAResultAfterFailuresOfTheStore) {
  hooks.failing_results = hooks.failing_claims = 3;
  const std::string id = submit("finish kept");  // before the start: it is claimed by the supervisor
  start();
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).report, R"({"text":"kept"})");
  EXPECT_EQ(find(id).attempt, 1);
  EXPECT_EQ(log.count("store_failure"), 6);
}

TEST_F(SupervisorTest, FailsAJobWhoseResultCannotBeStoredInAnyAttempt) {
  hooks.failing_results = 1'000'000;
  start();
  const std::string id = submit("finish lost");
  expect_failure(id, "storage_failure", 3, "the disk is full");
  EXPECT_EQ(hooks.failing_results, 1'000'000 - 3 * 10) << "ten tries of each attempt";
}

TEST_F(SupervisorTest, ReplacesAWorkerThatHangsWhileItStarts) {
  setenv("FAKE_WORKER_HANGS", path("hangs").c_str(), 1);
  create("hangs");
  start([](auto& with) { with.start_timeout = std::chrono::seconds(1); });
  EXPECT_TRUE(
      eventually([&] { return log.fields("worker_ended").find("was not ready within 1000 ms") != std::string::npos; }));
  std::filesystem::remove(path("hangs"));
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
  unsetenv("FAKE_WORKER_HANGS");
}

TEST_F(SupervisorTest, WarnsOfAWorkerThatIsNotFullyRestricted) {
  start();
  ASSERT_TRUE(reaches(submit("finish done"), JobState::succeeded));
  EXPECT_EQ(log.fields("sandbox_incomplete"), "sandbox= full=seccomp, landlock ");
}
