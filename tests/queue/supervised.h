#pragma once
/// A queue with a supervisor of the fake worker, which executes documents as scripts.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/queue.h"
#include "server/queue/queue_maintainer.h"
#include "server/worker/supervisor/supervisor.h"
#include "tests/conformance/test_store.h"
#include "tests/queue/eventually.h"

/// Events of the log, counted by name.
class RecordedLog {
 public:
  queue::Log log() {
    return [this](queue::LogLevel, std::string_view event, const queue::LogFields& fields) {
      const std::lock_guard lock(mutex_);
      std::string& lines = lines_[std::string(event)];
      for (const auto& [key, value] : fields) lines.append(key).append("=").append(value).append(" ");
      ++counts_[std::string(event)];
    };
  }
  int count(const std::string& event) {
    const std::lock_guard lock(mutex_);
    return counts_[event];
  }
  std::string fields(const std::string& event) {
    const std::lock_guard lock(mutex_);
    return lines_[event];
  }

 private:
  std::mutex mutex_;
  std::map<std::string, int> counts_;
  std::map<std::string, std::string> lines_;
};

/// Fails the first calls as requested.
class FailingTransitions final : public queue::JobTransitions {
 public:
  explicit FailingTransitions(const queue::JobTransitions& target) : JobTransitions(target) {}
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<queue::Artifact>& artifacts, bool durable, bool rendered) override {
    if (failures-- > 0) throw queue::StoreFailure(queue::StoreFailure::Kind::full, "disk full");
    return JobTransitions::succeed(id, fence, now, report, artifacts, durable, rendered);
  }
  std::optional<queue::Claim> claim(const queue::ClaimTerms& terms, std::int64_t now,
                                    const queue::ClaimFilter& filter) override {
    if (claim_failures-- > 0) throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "I/O error");
    std::optional<queue::Claim> claim = JobTransitions::claim(terms, now, filter);
    if (!filter.busy_owners.empty() && after_limited_claim) std::exchange(after_limited_claim, nullptr)();
    if (filter.suspects && after_suspect_claim) std::exchange(after_suspect_claim, nullptr)();
    return claim;
  }
  std::function<void()> after_limited_claim;  ///< called once, within a claim that excludes owners
  std::function<void()> after_suspect_claim;  ///< called once, within a claim of suspects
  std::atomic<int> failures = 0, claim_failures = 0;
};

class SupervisorTest : public testing::Test {
 protected:
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

  std::string submit(const std::string& document, int max_attempts = 3) {
    queue::Submission submission;
    submission.document = document;
    submission.job.width = submission.job.height = 4096;  // images of all tests fit
    submission.job.formats = "png exr";
    submission.job.max_attempts = max_attempts;
    return queue.submission.submit(std::move(submission))->view.job.id;
  }
  /// One that api::is_large.
  std::string submit_large(const std::string& document) {
    queue::Submission submission;
    submission.document = document;
    submission.job.width = submission.job.height = 4096;
    submission.job.large = true;
    return queue.submission.submit(std::move(submission))->view.job.id;
  }
  /// Failed at its deadline. The clock of the queue stands still, so that the job has begun before, however busy the
  /// machine is.
  std::string overrun(const std::string& document) {
    frozen_at = queue::system_clock()();
    queue::Submission submission;
    submission.document = document;
    submission.job.deadline = frozen_at + 50;
    std::string id = queue.submission.submit(std::move(submission))->view.job.id;
    EXPECT_TRUE(reaches(id, queue::JobState::failed));
    frozen_at = 0;
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
    const bool done = result.wait_for(std::chrono::minutes(1)) == std::future_status::ready;
    return done ? result.get().bytes : "no result";
  }
  queue::Job find(const std::string& id) { return queue.queries.find(id).value().job; }
  queue::JobState state(const std::string& id) { return find(id).state; }
  bool reaches(const std::string& id, queue::JobState wanted) {
    return eventually([&] { return state(id) == wanted; });
  }
  std::string problem_code(const std::string& id) { return find(id).problem.value_or(queue::Problem{}).code; }

  std::string path(const std::string& name) const { return directory.path() + "/" + name; }
  void create(const std::string& name) const { std::ofstream(path(name)) << "."; }

  std::atomic<std::int64_t> frozen_at = 0;
  TemporaryDirectory directory;
  RecordedLog log;
  TemporaryStores temporary;
  TestStore& store = temporary.store;
  queue::ArtifactStore& artifacts = temporary.artifacts;
  queue::IdSource ids{queue::system_clock(), queue::system_random()};
  FailingTransitions transitions{store.all().transitions};
  queue::Queue queue{
      {store.all().jobs, store.all().statistics, transitions, store.all().batches, store.all().maintenance},
      artifacts,
      ids,
      [this] { return frozen_at != 0 ? frozen_at.load() : queue::system_clock()(); },
      log.log(),
      {}};
  std::jthread maintainer =
      queue::maintain(queue.lifecycle, log.log(), {std::chrono::milliseconds(2), std::chrono::milliseconds(1)});
  std::jthread lease_renewer = queue::renew_leases(queue.lifecycle, log.log());
  std::unique_ptr<worker::Supervisor> supervisor;
};
