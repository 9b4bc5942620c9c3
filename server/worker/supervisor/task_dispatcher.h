#pragma once
/// Tasks between their store and the worker process: those of the jobs that run here, and those of other nodes while
/// this one has nothing else to do.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/queue.h"
#include "server/queue/task_store.h"
#include "server/queue/wakeups.h"
#include "server/worker/supervisor/job_dispatcher.h"
#include "server/worker/supervisor/outcome_writer.h"
#include "server/worker/supervisor/worker_process.h"

namespace worker {

/// Used by the thread of the event loop. Without a store of tasks all functions do nothing.
class TaskDispatcher {
 public:
  TaskDispatcher(queue::Queue& queue, const SupervisorSettings& settings, StoreExecutor& executor, LoopEvents& events,
                 WorkerProcess& process, const JobDispatcher& jobs, queue::Log log);

  /// Reads results of this node's tasks and, unless it is `draining`, claims tasks of others, if that is due.
  void run(Time now, bool draining);
  [[nodiscard]] Time next() const;  ///< when run() has something to do
  void on_message(Message& message);
  void on_worker_exit();

  [[nodiscard]] int running() const { return static_cast<int>(helping_.size()); }  ///< tasks of other nodes
  [[nodiscard]] bool idle() const { return pending_ == 0; }                        ///< no call of the store is pending

 private:
  using Key = std::pair<std::string, std::string>;  ///< job and task

  /// Calls `call` on another thread, then `done` on this one with its result; none if it has failed.
  template <class Call, class Done>
  void call_store(const char* operation, Call call, Done done);
  void call_store(const char* operation, std::function<void()> call);
  void publish(PublishTasks& message);
  void take(const std::string& job_id);
  void on_traced(TaskTraced& message);
  void read_results();
  void help();
  [[nodiscard]] bool can_help() const;
  void start_helping(queue::TaskClaim claim);
  void count_helpers();
  void release(const queue::TaskClaim& claim);
  void release_unused_claims();

  queue::Queue& queue_;
  queue::TaskStore* const store_;
  queue::Wakeups* const wakeups_;
  StoreExecutor& executor_;
  LoopEvents& events_;
  WorkerProcess& process_;
  const JobDispatcher& jobs_;
  const queue::Log log_;
  const std::size_t helping_max_;

  int pending_ = 0;                          ///< calls of the store
  bool reading_ = false, claiming_ = false;  ///< a call of this kind is pending
  struct DividedJob {
    std::set<std::string> keys;  ///< tasks without a result here
    std::uint64_t bytes = 0;     ///< size of all parts
  };
  std::map<std::string, DividedJob> awaited_;     ///< by job that runs here
  std::map<Key, queue::TaskClaim> own_;           ///< claims for the jobs that run here
  std::map<Key, queue::TaskClaim> helping_;       ///< claims of other nodes' tasks
  std::pair<std::string, std::string> document_;  ///< id of the job of the latest claim, and its document
  std::set<std::string> excluded_;                ///< jobs that this worker cannot trace
  struct {
    Time read{}, help{}, second{};
  } next_;  ///< when these are due
  std::vector<std::shared_ptr<void>> subscriptions_;
};

}  // namespace worker
