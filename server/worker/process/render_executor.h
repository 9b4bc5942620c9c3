#pragma once
/// The threads of the worker: some render jobs, one sends heartbeats, progress and previews.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/worker/process/jobs.h"
#include "server/worker/process/task_exchange.h"
#include "server/worker/process/task_tracer.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/scene_cache.h"

namespace worker {

/// Never stopped: the process ends without joining its threads. Thread-safe.
class RenderExecutor {
 public:
  /// `nice_level`: that of this process; threads of large jobs get a lower priority.
  RenderExecutor(int socket, const Options& options, FileClient& file_client, int nice_level);

  /// Answers on the socket when the job has ended. Each job has its own oneTBB arena, so that a thread that waits for
  /// the last tiles of one job never starts tiles of another; all arenas share the threads of the machine. A large job
  /// runs on its own thread, because its threads get a lower priority that cannot be raised again.
  void assign(Assign assigned);
  void cancel(const Cancel& message);
  void request_preview(const PreviewRequest& request);
  /// Traces a part of an image of another node on a thread of its own, and answers.
  void trace_task(TraceTask task);
  /// Answers with the live form of a scene, on a thread of its own; one is made at a time.
  void make_live_form(ImageTask task);
  void on_task_taken(const TaskTaken& message);
  void on_task_done(TaskDone message);
  void on_helpers(const Helpers& message) { helpers_ = message.count; }

 private:
  struct Job {
    JobControl control;
    std::uint64_t sent_progress = 0;        ///< tiles or steps
    std::set<std::uint32_t> preview_sides;  ///< requested and not sent
    std::mutex last_preview;                ///< held until it is sent, which is before the outcome
  };

  void run_waiting_jobs();
  void run_large_job(Assign assigned);
  void run_job(Assign assigned);
  void heartbeat_loop();
  void trim_heap(std::chrono::steady_clock::time_point now);
  void send_progress();
  void send_previews();
  std::shared_ptr<Job> find(const std::string& id);  ///< null if it does not wait or run
  std::shared_ptr<TaskExchange> exchange_of(const std::string& job_id);

  const int socket_;
  const Options options_;
  const int nice_level_;
  const JobFiles files_;
  tracer::SceneCache cache_;
  std::atomic<std::int64_t> helpers_ = 0;  ///< other nodes that have nothing to do
  const TaskChannel channel_;
  TaskTracer task_tracer_;
  std::mutex live_mutex_;  ///< held while a live form is made
  std::mutex mutex_;
  std::condition_variable job_available_, busy_;
  std::deque<Assign> waiting_jobs_;                   ///< assigned to the shared threads, not started
  std::map<std::string, std::shared_ptr<Job>> jobs_;  ///< waiting and running
  bool needs_trim_ = false;                           ///< a job has ended since trim_heap
  std::chrono::steady_clock::time_point idle_since_;  ///< end of the latest job
  std::vector<std::thread> threads_;
};

}  // namespace worker
