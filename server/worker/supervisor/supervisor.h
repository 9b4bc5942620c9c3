#pragma once
/// Runs the queue's jobs in a worker process that may die: starts it, feeds it, replaces it, and sees to it that a
/// death costs nobody a job.
///
///   worker::SupervisorSettings settings;                   // executable: worker::worker_beside_this_program()
///   worker::Supervisor supervisor(queue, settings, log);   // starts the worker at once
///   ... on SIGTERM, after HTTP stopped accepting:
///   supervisor.drain(std::chrono::seconds(30));
///
/// An attempt that failed for a reason that may pass is followed by another one after a pause (retry_rules.h).
///
/// Who pays for a death: a job that ran alone loses the attempt, and with its last one fails as "worker_crashed", the
/// signal named. Of several in flight none is blamed: they become suspects, wait until the worker is empty and run one
/// at a time, before all others, so the killer is found. A worker that had to be killed because a cancelled job did not
/// stop, or that is stopped by drain, costs no attempt at all.
///
/// Beside the worker in use a spare one is kept ready: when one ends nobody waits for the start of the next, nor for
/// the system to take back what the last one had.

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "server/queue/event_log.h"
#include "server/queue/queue.h"
#include "server/worker/protocol/worker_options.h"
#include "server/worker/supervisor/retry_rules.h"

namespace worker {

struct SupervisorSettings {
  std::string executable;  ///< absolute path of whittled-worker
  /// Jobs that run at once. Where there are several, large ones (queue::Job) leave the last place to the others, which
  /// so never wait for a large one to end: all places share the threads, in which a job that runs by itself has them
  /// all. 0: one more than threads, so that small jobs, which are mostly not parallel, fill the machine too.
  int slots = 0;
  int threads = 0;  ///< see Options
  FileSettings files;
  /// What a worker keeps of jobs' geometry and images for the next jobs, beside job_memory_bytes.
  std::uint64_t scene_cache_bytes = 512u << 20;
  std::chrono::milliseconds cache_idle{60'000};  ///< see Options
  /// Threads that claim jobs and store results, each waiting for the disk most of its time. A result takes one sync, a
  /// large image two before it (file, directory), which the disk shares among all who wait: so there are many, that a
  /// disk of 10 ms a sync does not hold small jobs up. 0: 16, or slots where that is more.
  int store_threads = 0;
  /// A worker from which nothing came for this long is killed. It beats every second from a thread of its own, so only
  /// a stopped process or a machine that swaps is silent this long.
  std::chrono::milliseconds heartbeat_timeout{10'000};
  /// From start to ready: loading Embree and the image library takes 0.2 s, on a cold disk seconds.
  std::chrono::milliseconds start_timeout{60'000};
  /// A job that is cancelled, or whose time is over, is told as ended after this, whether the worker has obeyed or not
  /// (100 ms are promised, a commit fits into the rest). The tracer stops within some rays; a large file or BVH may
  /// take a second or two.
  std::chrono::milliseconds cancel_answer{10};
  /// A worker that has not stopped it after this, has no other job and can be replaced at once, since a spare one is
  /// ready, is killed ...
  std::chrono::milliseconds cancel_replace{50};
  /// ... and one that has others, whose work would be lost, or no spare one behind it, after this.
  std::chrono::milliseconds cancel_grace{5'000};
  /// Pause before a worker that died is started again; doubles with each death until one finishes a job.
  std::chrono::milliseconds restart_pause{50};
  std::chrono::milliseconds restart_pause_max{5'000};
  /// Pause after the store refused a claim or a result. A result is tried `store_tries` times, then the attempt has
  /// failed as "storage_failure".
  std::chrono::milliseconds store_pause{500};
  int store_tries = 10;
  RetrySettings retry;
  /// An attempt that takes longer is stopped and has failed as "timed_out". A day: whatever takes longer hangs.
  std::chrono::milliseconds wall_time{std::chrono::hours(24)};
  /// A worker that has more than this for each of its jobs, beyond what it had before the first and what it keeps for
  /// the next ones, is killed, and they have failed as "out_of_memory"; looked at with each of its heartbeats.
  std::uint64_t job_memory_bytes = 16ull << 30;
};

/// "/path/of/this/program's/directory/whittled-worker"
std::string worker_beside_this_program();

/// Attaches itself to the queue and detaches when it goes. Thread-safe. The queue must outlive it.
class Supervisor {
 public:
  /// Throws std::system_error when threads or descriptors cannot be had. A worker that cannot be started is no
  /// exception: it is logged, told by not_ready (through Queue::not_ready) and tried again.
  Supervisor(queue::Queue& queue, SupervisorSettings settings, queue::Log log);
  /// As drain(0).
  ~Supervisor();

  /// Claims nothing more, waits up to `patience` for running jobs to end, gives the others back to the queue without
  /// cost and ends the worker. True when all ended by themselves. Only the first call counts.
  bool drain(std::chrono::milliseconds patience);

  [[nodiscard]] int worker_pid() const;  ///< 0 while there is none; for the log, metrics and tests
  [[nodiscard]] int running() const;     ///< jobs in the worker now
  /// Bytes that the worker keeps for later jobs, as it told last; none while there is no worker.
  struct Kept {
    std::uint64_t geometry = 0, images = 0;
  };
  [[nodiscard]] Kept kept() const;
  /// What the latest worker was held by ("seccomp, landlock"); empty until the first is ready.
  [[nodiscard]] std::string sandbox() const;

 private:
  class Loop;
  queue::Queue& queue_;
  std::unique_ptr<Loop> loop_;
};

}  // namespace worker
