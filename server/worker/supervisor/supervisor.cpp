#include "server/worker/supervisor/supervisor.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "server/worker/supervisor/job_dispatcher.h"
#include "server/worker/supervisor/outcome_writer.h"
#include "server/worker/supervisor/task_dispatcher.h"
#include "server/worker/supervisor/worker_process.h"

namespace worker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t image_tasks_max = 64;  // a page shows some tens of thumbnails at once
/// Limit for the files of all tasks, which are copied for the worker. One that is larger runs if no other task waits.
constexpr std::uint64_t image_task_bytes_max = 2ull << 30;

std::uint64_t bytes_of(const queue::ImageTask& task) {
  std::uint64_t bytes = 0;
  for (const auto& image : task.images) bytes += image->size_bytes();
  return bytes;
}

SupervisorSettings with_defaults(SupervisorSettings settings) {
  if (settings.slots <= 0) settings.slots = settings.thread_count() + 1;
  if (settings.owner_slots <= 0) settings.owner_slots = std::max(1, settings.slots - 1);
  if (settings.store_threads <= 0) settings.store_threads = std::max(16, settings.slots);
  return settings;
}

}  // namespace

/// One thread that owns the worker process and its jobs. It never waits for the store: StoreExecutor
/// calls it and posts the results back.
class Supervisor::Loop final : public queue::JobRunner {
 public:
  Loop(queue::Queue& queue, SupervisorSettings settings, const queue::Log& log)
      : settings_(with_defaults(std::move(settings))),
        store_executor_(std::make_unique<StoreExecutor>(settings_.store_threads, settings_.store_pause, log)),
        process_(settings_, log),
        outcomes_(queue, *store_executor_, events_, settings_, log),
        dispatcher_(queue, settings_, *store_executor_, events_, process_, outcomes_, log),
        task_dispatcher_(queue, settings_, *store_executor_, events_, process_, dispatcher_, log),
        thread_([this] { run(); }) {}

  ~Loop() override { drain(std::chrono::milliseconds(0)); }

  [[nodiscard]] int slots() const { return settings_.claims_jobs ? settings_.slots : 0; }

  void notify(bool for_suspects) noexcept override {
    dispatcher_.on_jobs_available(for_suspects);
    events_.interrupt();
  }

  void cancel(const std::string& id) noexcept override {
    events_.post([this, id] { dispatcher_.cancel(id); });
  }

  void request_preview(const std::string& id, std::uint32_t side) noexcept override {
    events_.post([this, id, side] { dispatcher_.request_preview(id, side); });
  }

  using TaskDone = std::function<void(queue::ImageTaskResult)>;
  void run_image_task(const queue::ImageTask& task, const TaskDone& done) noexcept override {
    events_.post([this, task, done] { start_image_task(task, done); });
  }

  void on_lease_lost(const queue::Lease& lease) noexcept override {
    events_.post([this, lease] { dispatcher_.on_lease_lost(lease); });
  }

  std::string not_ready() override { return dispatcher_.draining() ? "draining" : process_.not_ready(); }

  bool drain(std::chrono::milliseconds timeout) {
    const std::lock_guard lock(drain_mutex_);
    if (thread_.joinable()) {
      events_.post([this, timeout] {
        dispatcher_.start_drain();
        drain_end_ = Clock::now() + timeout;
        process_.stop_starting();
      });
      thread_.join();
      store_executor_.reset();
    }
    return !interrupted_by_drain_;
  }

  [[nodiscard]] const WorkerProcess& process() const { return process_; }
  [[nodiscard]] const JobDispatcher& dispatcher() const { return dispatcher_; }

 private:
  void run() {
    for (;;) {
      const auto now = Clock::now();
      if (now >= drain_end_) {
        drain_end_ = Clock::time_point::max();
        drain_ended_ = true;
        store_executor_->stop_retrying();
        outcomes_.backlog().stop();
      }
      if (dispatcher_.draining() && (dispatcher_.running() == 0 || drain_ended_)) {
        process_.end("was stopped by drain", true);
        handle_worker_exit();
        if (process_.state() == WorkerState::absent && dispatcher_.idle() && task_dispatcher_.idle())
          return end_image_tasks("the daemon is stopping", false);
      }
      process_.start_if_due(now);
      dispatcher_.claim_jobs(now);
      task_dispatcher_.run(now, dispatcher_.draining());
      send_image_tasks();
      process_.wait(events_.descriptor(), next_deadline());
      read_messages();
      handle_worker_exit();
      for (const auto& event : events_.take()) event();
      dispatcher_.check_deadlines(Clock::now());  // after reading: messages received during the wait count
      process_.check_timeouts(Clock::now());
      handle_worker_exit();
    }
  }

  void read_messages() {
    // The limit keeps a flood of messages from delaying everything else; an exited process sends a finite number.
    for (int count = 0; count < 256 || process_.exited(); ++count) {
      const std::size_t tasks = task_dispatcher_.running() > 0 ? 1 : 0;
      auto message = process_.receive(static_cast<std::size_t>(dispatcher_.running()) + tasks);
      if (!message) break;
      if (auto* result = std::get_if<ImageTaskResult>(&*message)) end_image_task(*result);
      dispatcher_.on_message(*message);
      task_dispatcher_.on_message(*message);
    }
    process_.reap_if_exited();
  }

  /// A task waits for a worker that is ready, and for the next one if its worker is ended for another reason.
  struct StartedTask {
    queue::ImageTask task;
    TaskDone done;
    std::shared_ptr<Packet> unsent;  ///< null while the files are copied, and once the worker has the task
    bool sent = false;
  };

  void start_image_task(const queue::ImageTask& task, const TaskDone& done) {
    const std::uint64_t bytes = bytes_of(task);
    if (!tasks_.empty() && (tasks_.size() >= image_tasks_max || task_bytes_ + bytes > image_task_bytes_max))
      return done({"too many images wait", {}});
    const std::uint64_t number = ++last_task_;
    tasks_.emplace(number, StartedTask{task, done, nullptr});
    task_bytes_ += bytes;
    prepare_image_task(number, task);
  }

  void prepare_image_task(std::uint64_t number, const queue::ImageTask& task) {
    store_executor_->run([this, number, task] {
      try {
        ImageTask message{number, task.work, {}};
        for (const auto& image : task.images) message.images.push_back(sealed_memory(*image));
        events_.post([this, number, packet = std::make_shared<Packet>(pack(std::move(message)))] {
          if (const auto started = tasks_.find(number); started != tasks_.end()) started->second.unsent = packet;
        });
      } catch (const std::exception& failure) {
        events_.post(
            [this, result = ImageTaskResult{number, {failure.what(), {}}}]() mutable { end_image_task(result); });
      }
    });
  }

  void send_image_tasks() {
    if (process_.state() != WorkerState::ready) return;
    for (auto& [number, task] : tasks_)
      if (const auto packet = std::exchange(task.unsent, nullptr)) {
        process_.send(std::move(*packet));
        task.sent = true;
      }
  }

  void end_image_task(ImageTaskResult& result) {
    const auto task = tasks_.extract(result.number);
    if (!task) return;
    task_bytes_ -= bytes_of(task.mapped().task);
    task.mapped().done(std::move(result.result));
  }

  void end_image_tasks(const char* failure, bool only_sent) {
    std::erase_if(tasks_, [&](const auto& entry) {
      const StartedTask& task = entry.second;
      if (only_sent && !task.sent) return false;
      task_bytes_ -= bytes_of(task.task);
      task.done({failure, {}});
      return true;
    });
  }

  void handle_worker_exit() {
    const auto exit = process_.take_exit();
    if (!exit) return;
    if (!exit->planned_shutdown) end_image_tasks("the worker has ended", true);  // one of them may be the cause
    for (auto& [number, task] : tasks_)
      if (std::exchange(task.sent, false)) prepare_image_task(number, task.task);
    task_dispatcher_.on_worker_exit();
    if (dispatcher_.on_worker_exit(*exit) > 0 && dispatcher_.draining()) interrupted_by_drain_ = true;
  }

  [[nodiscard]] Clock::time_point next_deadline() const {
    const auto now = Clock::now();
    return std::min({now + std::chrono::minutes(1), process_.next_deadline(), dispatcher_.next_deadline(now),
                     task_dispatcher_.next(), drain_end_});
  }

  const SupervisorSettings settings_;
  LoopEvents events_;
  std::unique_ptr<StoreExecutor> store_executor_;
  WorkerProcess process_;
  OutcomeWriter outcomes_;
  JobDispatcher dispatcher_;
  TaskDispatcher task_dispatcher_;
  std::uint64_t last_task_ = 0;
  std::map<std::uint64_t, StartedTask> tasks_;              ///< images in work, by number
  std::uint64_t task_bytes_ = 0;                            ///< total size of `tasks_`
  Clock::time_point drain_end_ = Clock::time_point::max();  ///< until it has passed
  bool drain_ended_ = false, interrupted_by_drain_ = false;
  std::mutex drain_mutex_;
  std::thread thread_;  ///< last: starts after the other members
};

// ---- Supervisor

std::string default_executable() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "whittled-worker";
}

Supervisor::Supervisor(queue::Queue& queue, SupervisorSettings settings, const queue::Log& log)
    : queue_(queue), loop_(std::make_unique<Loop>(queue, std::move(settings), log)) {
  queue_.runner.attach(loop_.get());
  loop_->notify(false);  // for jobs that were submitted before attach
}

Supervisor::~Supervisor() {
  queue_.runner.attach(nullptr);
  loop_->drain(std::chrono::milliseconds(0));
}

bool Supervisor::drain(std::chrono::milliseconds timeout) { return loop_->drain(timeout); }
int Supervisor::worker_pid() const { return loop_->process().pid(); }
int Supervisor::running() const { return loop_->dispatcher().running(); }
int Supervisor::slots() const { return loop_->slots(); }
Supervisor::CacheBytes Supervisor::cache_bytes() const { return loop_->process().cache_bytes(); }
std::string Supervisor::sandbox() const { return loop_->process().sandbox(); }

}  // namespace worker
