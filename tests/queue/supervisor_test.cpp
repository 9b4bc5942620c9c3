/// Jobs of a correct worker, cancel and drain.

#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <set>
#include <sstream>

#include "tests/queue/supervised.h"

using queue::JobState;

namespace {

/// Child processes that are not reaped.
std::set<int> children() {
  std::set<int> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string line;
    if (!std::getline(file, line)) continue;
    std::istringstream after_name(line.substr(line.rfind(')') + 1));  // "pid (name) state parent ..."
    std::string state;
    int parent = 0;
    after_name >> state >> parent;
    if (parent == getpid()) found.insert(std::stoi(line));
  }
  return found;
}

}  // namespace

TEST_F(SupervisorTest, StoresReportAndImageOfAJob) {
  start();
  const std::string id = submit("progress 1 2\nfinish hello");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  const queue::Job job = find(id);
  EXPECT_EQ(job.report, R"({"text":"hello"})");
  ASSERT_EQ(job.artifacts.size(), 1u);
  EXPECT_EQ(job.artifacts[0].name, "image.png");
  EXPECT_EQ(bytes_of(queue.queries.open(job.artifacts[0])), "hello");
  EXPECT_EQ(job.attempt, 1);
}

TEST_F(SupervisorTest, RunsHundredsOfJobsFromSeveralThreads) {
  start();
  in_threads(4, [&](int thread) {
    for (int i = 0; i < 100; ++i) submit("finish " + std::to_string(thread) + "-" + std::to_string(i % 10));
  });
  EXPECT_TRUE(eventually([&] { return store.count(JobState::succeeded) == 400; }));
  EXPECT_EQ(log.count("job_assigned"), 400);
  EXPECT_EQ(log.count("worker_started"), 1);
}

TEST_F(SupervisorTest, CarriesALargeDocument) {
  start();
  const std::string id = submit(std::string(30u << 20, 'x') + "\nfinish large");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).report, R"({"text":"large"})");
}

TEST_F(SupervisorTest, RunsNoMoreJobsAtOnceThanSlots) {
  start(settings(3));
  std::vector<std::string> ids_of_jobs;
  for (int i = 0; i < 8; ++i) ids_of_jobs.push_back(submit("wait " + path("go")));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 3; }));
  EXPECT_EQ(store.count(JobState::running), 3);
  create("go");
  for (const std::string& id : ids_of_jobs) EXPECT_TRUE(reaches(id, JobState::succeeded));
}

TEST_F(SupervisorTest, RunsSmallJobsWhileLargeOnesRunAndWait) {
  start(settings(3));
  std::vector<std::string> large;
  for (int i = 0; i < 6; ++i) large.push_back(submit_large("wait " + path("go")));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; })) << "one slot is left to small jobs";
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(reaches(submit("finish small"), JobState::succeeded));
  EXPECT_EQ(store.count(JobState::running), 2);
  EXPECT_EQ(store.count(JobState::queued), 4);
  create("go");
  for (const std::string& id : large) EXPECT_TRUE(reaches(id, JobState::succeeded));
}

TEST_F(SupervisorTest, RunsLargeJobsInASingleSlot) {
  start(settings(1));
  const std::string large = submit_large("finish large"), small = submit("finish small");
  EXPECT_TRUE(reaches(large, JobState::succeeded));
  EXPECT_TRUE(reaches(small, JobState::succeeded));
}

TEST_F(SupervisorTest, StoresTheProblemOfAFailure) {
  start();
  const std::string id = submit("fail bad_scene");
  ASSERT_TRUE(reaches(id, JobState::failed));
  EXPECT_EQ(problem_code(id), "bad_scene");
  EXPECT_EQ(find(id).problem->errors, (std::vector<tracer::Issue>{{"/a", "b", "c"}}));
  EXPECT_EQ(find(id).attempt, 1) << "another attempt cannot succeed";
}

TEST_F(SupervisorTest, ReportsProgress) {
  start();
  const std::string id = submit("progress 1 4\nprogress 3 4\nprogress 2 4\nprogress 1 0\nwait " + path("go"));
  EXPECT_TRUE(eventually([&] { return queue.queries.progress(id) == 0.75; }));
  create("go");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(queue.queries.find(id)->progress, 1);
}

TEST_F(SupervisorTest, CancelsAtAnyTimeBetweenClaimAndEnd) {
  start();
  for (int round = 0; round < 100; ++round) {
    const std::string id = submit("wait " + path("never"));
    if (round % 2 == 0) std::this_thread::sleep_for(std::chrono::microseconds(20 * round));
    const queue::CancelOutcome outcome = queue.lifecycle.cancel(id);
    ASSERT_TRUE(outcome == queue::CancelOutcome::cancelled || outcome == queue::CancelOutcome::cancelling);
    ASSERT_TRUE(reaches(id, JobState::cancelled)) << "round " << round;
  }
  EXPECT_TRUE(eventually([&] { return supervisor->running() == 0; }));
}

TEST_F(SupervisorTest, ReportsACancelThatTheWorkerIgnores) {
  start(impatient());
  const std::string id = submit("hang " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  queue.lifecycle.cancel(id);
  EXPECT_TRUE(reaches(id, JobState::cancelled));
  EXPECT_EQ(supervisor->running(), 1) << "reported, although it still runs";
  create("go");
  EXPECT_TRUE(eventually([&] { return supervisor->running() == 0; }));
  EXPECT_EQ(state(id), JobState::cancelled) << "its result is late";
  EXPECT_TRUE(find(id).artifacts.empty());
  EXPECT_EQ(log.count("worker_started"), 1);
}

TEST_F(SupervisorTest, KeepsTheLastPreviewOfAJobWhoseTimeIsOver) {
  start([](auto& with) { with.wall_time = with.cancel_answer = std::chrono::milliseconds(50); }, impatient());
  const std::string id = submit("show 0 " + path("go"), 1);
  expect_failure(id, "timed_out", 1);
  ASSERT_TRUE(eventually([&] { return find(id).artifacts.size() == 1; }));
  create("go");
  EXPECT_EQ(find(id).artifacts.at(0).name, "preview.png");
}

TEST_F(SupervisorTest, KeepsTheLastPreviewOfAJobThatDoesNotStop) {
  start([](auto& with) { with.cancel_answer = std::chrono::milliseconds(50); }, impatient());
  for (const char* const delay_ms : {"0", "200"}) {  // before and after the end is reported
    const std::string id = submit(std::string("show ") + delay_ms + " " + path("go"));
    ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
    queue.lifecycle.cancel(id);
    EXPECT_TRUE(reaches(id, JobState::cancelled));
    EXPECT_TRUE(eventually([&] { return find(id).artifacts.size() == 1; })) << delay_ms;
    EXPECT_EQ(find(id).artifacts.at(0).name, "preview.png");
    create("go");
    EXPECT_TRUE(eventually([&] { return supervisor->running() == 0; }));
    std::filesystem::remove(path("go"));
  }
  EXPECT_EQ(log.count("worker_started"), 1);
}

TEST_F(SupervisorTest, HasOneWorkerUntilItsEnd) {
  start();
  ASSERT_TRUE(reaches(submit(""), JobState::succeeded));
  const int first = supervisor->worker_pid();
  EXPECT_EQ(children(), std::set<int>{first});
  kill(first, SIGKILL);
  ASSERT_TRUE(eventually([&] { return supervisor->worker_pid() != first && supervisor->worker_pid() != 0; }));
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
  EXPECT_EQ(children(), std::set<int>{supervisor->worker_pid()});
  supervisor.reset();
  EXPECT_TRUE(children().empty());
}

TEST_F(SupervisorTest, CountsNoAttemptOfOtherJobsForACrashOfACancelledOne) {
  start(impatient());
  const std::string other = submit("wait " + path("other"), 1);
  const std::string killer = submit("hang " + path("go") + "\ncrash");
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  queue.lifecycle.cancel(killer);
  ASSERT_TRUE(reaches(killer, JobState::cancelled));
  create("go");
  ASSERT_TRUE(eventually([&] { return log.count("worker_ended") == 1; }));
  create("other");
  EXPECT_TRUE(reaches(other, JobState::succeeded));
  EXPECT_EQ(find(other).attempt, 1);
  EXPECT_EQ(state(killer), JobState::cancelled);
}

TEST_F(SupervisorTest, ReplacesAWorkerThatDoesNotStopACancelledJobAtNoCost) {
  start([](auto& with) { with.cancel_grace = std::chrono::milliseconds(100); }, impatient());
  const std::string hanging = submit("hang " + path("never"));
  const std::string innocent = submit("wait " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  const int first_worker = supervisor->worker_pid();
  queue.lifecycle.cancel(hanging);
  ASSERT_TRUE(eventually([&] { return supervisor->worker_pid() != first_worker && supervisor->worker_pid() != 0; }));
  create("go");
  EXPECT_TRUE(reaches(innocent, JobState::succeeded));
  EXPECT_EQ(find(innocent).attempt, 1) << "released";
  EXPECT_FALSE(find(innocent).suspect);
  EXPECT_EQ(state(hanging), JobState::cancelled);
}

TEST_F(SupervisorTest, DrainWaitsForRunningJobsAndStartsNoOthers) {
  start();
  const std::string first = submit("wait " + path("go")), second = submit("wait " + path("go"));
  const std::string waiting = submit("");
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  bool all_ended = false;
  std::thread drain([&] { all_ended = supervisor->drain(std::chrono::minutes(1)); });
  EXPECT_TRUE(eventually([&] { return queue.queries.not_ready() == "draining"; }));
  create("go");
  drain.join();
  EXPECT_TRUE(all_ended);
  EXPECT_EQ(state(first), JobState::succeeded);
  EXPECT_EQ(state(second), JobState::succeeded);
  EXPECT_EQ(state(waiting), JobState::queued);
  EXPECT_EQ(supervisor->worker_pid(), 0);
}

TEST_F(SupervisorTest, DrainReleasesJobsAtItsEndAtNoCost) {
  start();
  const std::string slow = submit("wait " + path("never")), cancelled = submit("hang " + path("never"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  store.cancel(cancelled, 1);
  EXPECT_FALSE(supervisor->drain(std::chrono::milliseconds(10)));
  EXPECT_EQ(state(slow), JobState::queued);
  EXPECT_EQ(find(slow).attempt, 0);
  EXPECT_FALSE(find(slow).suspect);
  EXPECT_EQ(state(cancelled), JobState::cancelled);
}

TEST_F(SupervisorTest, ReportsWhyItIsNotReady) {
  auto wrong = settings();
  wrong.executable = path("no such worker");
  start(wrong);
  EXPECT_TRUE(eventually([&] {
    return queue.queries.not_ready().find("cannot start " + wrong.executable) != std::string::npos;
  })) << queue.queries.not_ready();
  // It is tried again: an executable that appears is started.
  std::filesystem::create_symlink(settings().executable, wrong.executable);
  EXPECT_TRUE(eventually([&] { return queue.queries.not_ready().empty(); })) << queue.queries.not_ready();
  EXPECT_TRUE(reaches(submit(""), JobState::succeeded));
}

TEST_F(SupervisorTest, PassesOnlyTheSocketAndNoSettingsToTheWorker) {
  const int leaky = open(path("leak").c_str(), O_RDWR | O_CREAT, 0600);  // without O_CLOEXEC, on purpose
  setenv("WHITTLE_SECRET", "secret", 1);
  start();
  ASSERT_TRUE(eventually([&] { return log.count("worker_ready") == 1; }));
  const std::string process = "/proc/" + std::to_string(supervisor->worker_pid());
  const auto open_files = [&] {
    std::set<std::string> found;
    std::error_code closed_meanwhile;
    for (const auto& entry : std::filesystem::directory_iterator(process + "/fd")) {
      const std::string target = std::filesystem::read_symlink(entry, closed_meanwhile);
      if (std::stoi(entry.path().filename()) > 2) found.insert(target.substr(0, target.find(':')));
    }
    return found;
  };
  // A sanitizer opens a pipe for moments; what is inherited stays open.
  EXPECT_TRUE(eventually([&] { return open_files() == std::set<std::string>{"socket"}; }))
      << testing::PrintToString(open_files());
  std::ifstream environment(process + "/environ");
  const std::string text((std::istreambuf_iterator<char>(environment)), {});
  EXPECT_EQ(text.find("WHITTLE_"), std::string::npos);
  EXPECT_NE(text.find("PATH="), std::string::npos);
  unsetenv("WHITTLE_SECRET");
  close(leaky);
}
