#pragma once
/// The worker process of the supervisor: start, messages, time limits, memory limit and exit.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/event_log.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/child_process.h"
#include "server/worker/supervisor/file_server.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

/// `ending`: its socket is closed, its process has not exited yet.
enum class WorkerState { absent, starting, ready, ending };

struct WorkerExit {
  int pid = 0;
  std::string reason;             ///< end of a sentence: "was killed by signal 11 (SIGSEGV)"
  bool planned_shutdown = false;  ///< no job is the cause
  std::string code;               ///< problem code of the job that is the cause
};

/// Used by one thread, except where noted.
class WorkerProcess {
 public:
  using Time = std::chrono::steady_clock::time_point;
  WorkerProcess(const SupervisorSettings& settings, queue::Log log)
      : settings_(settings), log_(std::move(log)), restart_pause_(settings.restart_pause) {}

  /// Starts the worker if there is none. A program that cannot be started is logged and tried again later.
  void start_if_due(Time now);
  /// Starts no process any more.
  void stop_starting() { may_start_ = false; }

  /// Waits until `until`, until `event_descriptor` is readable or until a process needs attention; logs output.
  void wait(int event_descriptor, Time until);
  /// The next message that was received, none if there is no more now. Ends a worker that violates the protocol or,
  /// with `job_count` jobs, the memory limit.
  std::optional<Message> receive(std::size_t job_count);
  /// Never blocks; no effect unless ready.
  void send(Packet packet);

  /// Kills the worker. `reason` is the end of a sentence that begins "The worker process". The next one need not wait
  /// until the system has reclaimed the memory of this one.
  void end(const std::string& reason, bool planned_shutdown, const char* code = "worker_crashed");
  [[nodiscard]] bool exited() const { return exited_; }
  void reap_if_exited();  ///< precondition: all messages are received
  /// The exit since the last call. No worker is started before it is taken.
  std::optional<WorkerExit> take_exit() { return std::exchange(exit_, std::nullopt); }

  void check_timeouts(Time now);
  [[nodiscard]] Time next_deadline() const;

  [[nodiscard]] WorkerState state() const { return state_; }
  void reset_restart_pause() { restart_pause_ = settings_.restart_pause; }

  // Any thread.
  [[nodiscard]] int pid() const { return pid_; }
  [[nodiscard]] Supervisor::CacheBytes cache_bytes() const { return {cache_geometry_bytes_, cache_image_bytes_}; }
  [[nodiscard]] std::string sandbox() const;
  [[nodiscard]] std::string not_ready() const;  ///< empty if ready, else the reason: "worker: starting"

 private:
  struct Instance {
    explicit Instance(const SupervisorSettings& settings);
    std::unique_ptr<FileServer> files;
    ChildProcess child;  ///< after `files`: its end closes the other end of their socket
    Time started_at = Time::clock::now();
  };

  void on_ready(const Ready& ready);
  void on_heartbeat(const Heartbeat& heartbeat, std::size_t job_count);
  void on_exit(const std::string& reason, bool planned_shutdown, const char* code);
  void log_output(ChildProcess& child) const;
  void set_not_ready(std::string reason);

  const SupervisorSettings& settings_;
  const queue::Log log_;
  std::unique_ptr<Instance> worker_;
  std::vector<std::unique_ptr<Instance>> killed_;  ///< a large process takes its time to exit
  WorkerState state_ = WorkerState::absent;
  bool may_start_ = true, exited_ = false;
  Time last_message_at_, restart_at_{};  ///< no worker is started before the second
  std::chrono::milliseconds restart_pause_;
  std::uint64_t base_memory_bytes_ = 0;  ///< before the first job
  std::optional<WorkerExit> exit_;

  std::atomic<int> pid_ = 0;
  std::atomic<std::uint64_t> cache_geometry_bytes_ = 0, cache_image_bytes_ = 0;
  mutable std::mutex status_mutex_;
  std::string not_ready_ = "worker: starting";
  std::string sandbox_;
};

}  // namespace worker
