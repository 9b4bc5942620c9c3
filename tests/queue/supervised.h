#pragma once
/// A queue with a supervisor of the fake worker, which executes documents as scripts.

#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>

#include "server/queue/queue_maintainer.h"
#include "server/worker/supervisor/supervisor.h"
#include "tests/queue/queue_fixture.h"
#include "tests/support/threads.h"

class SupervisorTest : public QueueFixture {
 protected:
  SupervisorTest() { now = 0; }
  static worker::SupervisorSettings settings(int slots = 2) {
    worker::SupervisorSettings result;
    result.executable = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "fake_worker";
    result.slots = slots;
    result.heartbeat_timeout = std::chrono::seconds(30);  // shortened by tests of the heartbeat
    result.cancel_answer = result.cancel_grace = std::chrono::seconds(30);
    result.restart_pause = std::chrono::milliseconds(1);
    result.restart_pause_max = std::chrono::milliseconds(20);
    result.store_pause = std::chrono::milliseconds(1);
    result.retry = {std::chrono::milliseconds(1), std::chrono::milliseconds(20)};
    return result;
  }
  /// Reports a cancel without waiting for the worker.
  static worker::SupervisorSettings impatient() {
    worker::SupervisorSettings result = settings();
    result.cancel_answer = std::chrono::milliseconds(1);
    result.cancel_grace = std::chrono::hours(1);
    return result;
  }
  void start(const worker::SupervisorSettings& with = settings()) {
    supervisor = std::make_unique<worker::Supervisor>(queue, with, log.log());
  }
  /// With a change of the settings.
  void start(const std::function<void(worker::SupervisorSettings&)>& change,
             worker::SupervisorSettings with = settings()) {
    change(with);
    start(with);
  }

  std::string submit(const std::string& document, int max_attempts = 3) {
    return submit_job(document, [&](queue::Job& job) {
      job.width = job.height = 4096;  // images of all tests fit
      job.formats = "png exr";
      job.max_attempts = max_attempts;
    });
  }
  /// One that api::is_large.
  std::string submit_large(const std::string& document) {
    return submit_job(document, [](queue::Job& job) { job.width = job.height = 4096, job.large = true; });
  }
  /// Failed at its deadline. The clock of the queue stands still, so that the job has begun before, however busy the
  /// machine is.
  std::string overrun(const std::string& document) {
    now = queue::system_clock()();
    std::string id = submit_job(document, [this](queue::Job& job) { job.deadline = now + 50; });
    EXPECT_TRUE(reaches(id, queue::JobState::failed));
    now = 0;
    return id;
  }
  std::future<queue::ImageTaskResult> run_image_task(const std::string& kind) {
    const auto result = std::make_shared<std::promise<queue::ImageTaskResult>>();
    queue::ImageTask task;
    task.work.kind = kind;
    queue.runner.run_image_task(task, [result](queue::ImageTaskResult done) { result->set_value(std::move(done)); });
    return result->get_future();
  }
  static std::string image_of(std::future<queue::ImageTaskResult> result) {
    const bool done = result.wait_for(std::chrono::minutes(10)) == std::future_status::ready;
    return done ? result.get().bytes : "no result";
  }
  queue::Job find(const std::string& id) { return QueueFixture::find(id).job; }
  bool reaches(const std::string& id, queue::JobState wanted) {
    return eventually([&] { return state(id) == wanted; });
  }
  /// Waits until the job has failed with this problem, whose sentence has this part, in this attempt.
  void expect_failure(const std::string& id, const std::string& code, int attempt, const std::string& part = "") {
    EXPECT_TRUE(reaches(id, queue::JobState::failed));
    EXPECT_EQ(problem_code(id), code);
    const std::string detail = find(id).problem.value_or(queue::Problem{}).detail;
    EXPECT_NE(detail.find(part), std::string::npos) << detail;
    EXPECT_EQ(find(id).attempt, attempt);
  }
  std::string problem_code(const std::string& id) { return find(id).problem.value_or(queue::Problem{}).code; }

  std::string path(const std::string& name) const { return temporary.directory.path() + "/" + name; }
  void create(const std::string& name) const { std::ofstream(path(name)) << "."; }

  std::jthread maintainer =
      queue::maintain(queue.lifecycle, log.log(), {std::chrono::milliseconds(2), std::chrono::milliseconds(1)});
  std::jthread lease_renewer = queue::renew_leases(queue.lifecycle, log.log());
  std::unique_ptr<worker::Supervisor> supervisor;
};
