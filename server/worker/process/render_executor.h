#pragma once
/// The worker's threads: some render jobs, one tells how they get on.

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

#include "server/worker/process/job_control.h"
#include "server/worker/process/job_stages.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/protocol/worker_options.h"
#include "tracer/scene_cache.h"

namespace worker {

/// Lives as long as the process: it is never stopped, the process ends under it. Thread-safe.
class RenderExecutor {
 public:
  RenderExecutor(int socket, const Options& options);

  /// Answers on the socket when the job has ended. Each job has a oneTBB arena of its own, so that a thread that waits
  /// for the last tiles of one job never starts on those of another; all arenas share the machine's threads.
  void assign(Assign job);
  void cancel(const std::string& job_id);
  void look(const Look& wish);

 private:
  /// One is for small jobs alone, where there are several: however many large ones run, its thread goes before theirs.
  enum class Place { small, any };
  struct Job {
    JobControl control;
    std::uint64_t told = 0;         ///< of its tiles or steps
    std::set<std::uint32_t> looks;  ///< sides of the previews that are asked for
  };

  [[nodiscard]] Outcome done(Assign assigned, JobControl& control);
  void work(Place place);
  [[nodiscard]] std::deque<Assign>::iterator next_for(Place place);
  void pulse();
  void trim_heap(std::chrono::steady_clock::time_point now);
  void tell_progress();
  void show_previews();
  void say(Message message);

  int socket_;
  Options options_;
  tracer::SceneCache cache_;
  std::mutex mutex_;
  std::condition_variable small_came_, job_came_;  ///< for the place for small ones, and for the others
  std::condition_variable busy_;
  std::deque<Assign> waiting_;
  bool small_place_free_ = false;
  std::map<std::string, std::shared_ptr<Job>> jobs_;  ///< waiting and running
  bool needs_trim_ = false;                           ///< a job has ended since memory was given back
  std::chrono::steady_clock::time_point idle_since_;  ///< without jobs, or when the latest came
  std::vector<std::thread> threads_;
};

}  // namespace worker
