#pragma once
/// Runs the jobs of the queue in a worker process: starts it, assigns jobs, replaces it when it ends.
///
///   worker::SupervisorSettings settings;                   // executable: worker::default_executable()
///   worker::Supervisor supervisor(queue, settings, log);   // starts the worker at once
///   ... on SIGTERM, after HTTP has stopped accepting:
///   supervisor.drain(std::chrono::seconds(30));
///
/// An attempt that failed for a transient reason is followed by another one after a pause (failure_policy.h).
///
/// If the worker crashes while it runs one job, the job loses the attempt, and after its last one fails as
/// "worker_crashed" with the signal. If it runs several, they become suspects at no cost: each then runs alone, before
/// all other jobs, so that the crashing one is found (failure_policy.h). A worker that is killed because it did not
/// stop a job, or by drain, costs no attempt. The next worker is ready in about 0.6 s.

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "server/queue/event_log.h"
#include "server/queue/queue.h"
#include "server/queue/task_store.h"
#include "server/queue/wakeups.h"
#include "server/worker/protocol/asset_directory.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/failure_policy.h"

namespace worker {

/// Jobs that run at once share the threads, and a job that runs alone has all of them. If there are several slots,
/// large jobs (queue::Job) leave one to the others, which otherwise wait until a large job ends. With 0 slots, the
/// default, there is one more than threads, because small jobs are mostly sequential. The cache is in addition to
/// job_memory_bytes. A worker with more memory for each of its jobs, beyond what it had before the first one and its
/// cache, is killed, and the jobs have failed as "out_of_memory"; checked at each heartbeat.
struct SupervisorSettings : Options {
  SupervisorSettings() { slots = 0, scene_cache_bytes = 512u << 20; }

  std::string executable;  ///< absolute path of whittled-worker
  /// False: no job is claimed; the worker only processes finished images (queue::ImageTask).
  bool claims_jobs = true;
  /// Jobs of one owner that run at once, so that the slots are not all occupied by jobs of one owner. 0: slots - 1.
  int owner_slots = std::numeric_limits<int>::max();
  /// A job that takes longer is large from then on. If it takes the last slot then, it is stopped and queued again,
  /// and the attempt does not count. Small jobs take some seconds at most (api::is_large).
  std::chrono::milliseconds small_job_time{10'000};
  OpenUpload open_upload;  ///< see SceneFiles
  /// Threads that claim jobs and store results. They mostly wait for the disk: a result takes one sync, a large image
  /// two more, and the disk combines the syncs of all threads. 0: the larger of 16 and slots.
  int store_threads = 0;
  /// A worker without a message for this long is killed. It sends a heartbeat every second from a separate thread, so
  /// only a stopped process or a swapping machine exceeds this.
  std::chrono::milliseconds heartbeat_timeout{10'000};
  /// Loading Embree and the image library takes 0.2 s, on a cold disk seconds.
  std::chrono::milliseconds start_timeout{60'000};
  /// A cancelled or overdue job is reported as ended after this, even if the worker has not stopped it yet (100 ms are
  /// promised; a commit fits into the rest). A large file or BVH may take a second or two to stop.
  std::chrono::milliseconds cancel_answer{10};
  /// After this a worker that has not stopped the job is killed.
  std::chrono::milliseconds cancel_grace{5'000};
  /// Pause before a crashed worker is started again; doubles with each crash until a job finishes.
  std::chrono::milliseconds restart_pause{50};
  std::chrono::milliseconds restart_pause_max{5'000};
  /// Pause after the store refused a claim or a result. A result is tried `store_tries` times (0: without limit), then
  /// the attempt has failed as "storage_failure".
  std::chrono::milliseconds store_pause{500};
  int store_tries = 10;
  /// Without a limit of tries, results that wait are written to unlinked files in this directory, up to
  /// `waiting_bytes`; while they have more, no job is claimed.
  std::string waiting_directory = "/tmp";
  std::uint64_t waiting_bytes = 4ull << 30;
  RetrySettings retry;
  /// A longer attempt is stopped and has failed as "timed_out". Whatever takes longer than a day hangs.
  std::chrono::milliseconds wall_time{std::chrono::hours(24)};
  /// The tasks that several nodes share, and messages about them; null: each image is traced by one node. Both must
  /// outlive the supervisor.
  queue::TaskStore* tasks = nullptr;
  queue::Wakeups* wakeups = nullptr;
};

/// Path of whittled-worker in the directory of this program.
std::string default_executable();

/// Attaches itself to the queue, and detaches on destruction. Thread-safe. The queue must outlive it.
class Supervisor {
 public:
  /// Throws std::system_error without threads or descriptors. A worker that cannot be started is logged, reported by
  /// Queue::not_ready and tried again.
  Supervisor(queue::Queue& queue, SupervisorSettings settings, const queue::Log& log);
  /// Calls drain(0).
  ~Supervisor();

  /// Claims no more jobs, waits up to `timeout` for running jobs, releases the others at no cost and ends the worker.
  /// True if no job was interrupted. Only the first call has an effect.
  bool drain(std::chrono::milliseconds timeout);

  [[nodiscard]] int worker_pid() const;  ///< 0 without a worker
  [[nodiscard]] int running() const;     ///< jobs in the worker
  [[nodiscard]] int slots() const;       ///< jobs that run at once; 0 if none are claimed
  /// Sizes of the worker's caches, as reported by its last heartbeat.
  struct CacheBytes {
    std::uint64_t geometry = 0, images = 0;
  };
  [[nodiscard]] CacheBytes cache_bytes() const;
  /// Restrictions of the latest worker, such as "seccomp, landlock"; empty until one is ready.
  [[nodiscard]] std::string sandbox() const;

 private:
  class Loop;
  queue::Queue& queue_;
  std::unique_ptr<Loop> loop_;
};

}  // namespace worker
