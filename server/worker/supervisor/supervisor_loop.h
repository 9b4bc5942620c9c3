#pragma once
/// The supervisor's one thread and all it knows: the worker process, the jobs in it, and when to do what. It waits for
/// nobody: the store is asked by StoreExecutor, which post their answers back.

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "server/support/event_queue.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/child_process.h"
#include "server/worker/supervisor/crash_policy.h"
#include "server/worker/supervisor/store_executor.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

class Supervisor::Loop final : public queue::JobRunner {
 public:
  Loop(queue::Queue& queue, SupervisorSettings settings, queue::Log log);
  ~Loop() override;

  void notify(bool for_suspects) noexcept override;
  void cancel(const std::string& id) noexcept override;
  void request_preview(const std::string& id, std::uint32_t side) noexcept override;
  void on_lease_lost(const queue::Lease& lease) noexcept override;
  std::string not_ready() override;
  std::string sandbox();

  bool drain(std::chrono::milliseconds patience);
  [[nodiscard]] int pid() const { return pid_; }
  [[nodiscard]] int running() const { return running_count_; }
  [[nodiscard]] Kept kept() const { return {kept_geometry_bytes_, kept_image_bytes_}; }

 private:
  using Clock = std::chrono::steady_clock;
  using Time = Clock::time_point;

  /// Of the worker: `ending` when its socket is at its end and its process not yet.
  enum class Life { absent, starting, ready, ending };

  /// A worker's process, in use or not yet.
  struct Worker {
    Worker(const std::string& executable, const Options& options) : process(executable, arguments_of(options)) {}
    Process process;
    Time started_at = Clock::now();
    std::optional<Hello> hello;  ///< it is ready
  };

  /// A job in the worker.
  struct Running {
    std::int64_t fence = 0;
    int attempt = 1, max_attempts = 1;
    bool large = false;                         ///< see queue::Job
    bool cancel_requested = false;              ///< by its owner
    bool lost = false;                          ///< the store has taken it back: how it ends is nobody's business
    std::optional<queue::Problem> stopped_for;  ///< by us
    std::optional<Time> stop_at;                ///< then its deadline has passed or its time is over: `overdue`
    queue::Problem overdue;
    std::optional<Time> answer_at;  ///< then the job is told as stopped, whatever the worker does
    bool answered = false;          ///< it was told: nobody waits for it any more
    Time replace_at{};              ///< of one that was answered: then the worker may be replaced
    std::optional<Time> kill_at;    ///< then the worker has disobeyed
  };

  enum class ClaimOf { any, small, suspect };

  /// What a store thread, or a submitter's, brings back from a claim.
  struct Claimed {
    ClaimOf of = ClaimOf::any;
    std::uint64_t wakes_seen = 0;  ///< when it was asked for
    bool took_last = false;        ///< where it found a job, that was the only one
    std::optional<queue::Claim> claim{};
    Packet assignment{};
    bool failed = false;
  };

  // The thread (supervisor_loop.cpp).
  void run();
  void wait(Time until);
  [[nodiscard]] Time next_deadline() const;
  void keep_times(Time now);
  void keep_draining(Time now);
  [[nodiscard]] bool idle() const { return running_.empty() && claiming_ == 0 && storing_ == 0; }
  void say_status(std::string status);

  // The worker's life (supervisor_life.cpp).
  std::unique_ptr<Worker> new_worker();
  void start_worker(Time now);
  void on_worker_ready();
  void read_worker();
  void end_worker(const std::string& why, bool planned_shutdown, const char* code = "worker_crashed");
  void watch_memory();
  void worker_ended();
  void on_worker_exit(const std::string& how, bool planned_shutdown, const char* code);
  [[nodiscard]] bool may_be_replaced(Time now) const;
  void keep_spare(Time now);
  void read_spare();
  std::string list_of_jobs() const;
  void log_spoken(Process& process);

  // Jobs (supervisor_jobs.cpp).
  void claim_jobs(Time now);
  [[nodiscard]] bool place_for(ClaimOf of) const;
  void claim(ClaimOf of);
  void ask(Claimed result) noexcept;
  void offer_claim(Time now);
  void end_offer();
  void claimed(const std::shared_ptr<Claimed>& result);
  void cancel_job(const std::string& id);
  void forward_preview_request(const std::string& id, std::uint32_t side);
  void lose_job(const queue::Lease& lease);
  Running running_job(const queue::Claim& claim) const;
  void stop(const std::string& id, Running& job);
  void answer_stopped(const std::string& id, const Running& job);
  void update_variances(const std::vector<InFlightJob>& casualties, const std::vector<CrashDecision>& verdicts,
                        const std::string& code);
  void give_back(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::chrono::milliseconds pause);
  void attempt_failed(const std::string& id, const Running& job, const queue::Problem& problem);
  void finish_cancel(const std::string& id, std::int64_t fence);
  void fail(const std::string& id, std::int64_t fence, const queue::Problem& problem);
  void store(std::function<void()> task);
  bool take(const std::string& id, std::int64_t fence, Running& job);
  void log_end(const char* event, const std::string& id, bool moved, queue::LogFields more = {});

  void on_message(Hello& message);
  void on_message(Heartbeat& message);
  void on_message(Progress& message);
  void on_message(Looked& message);
  void on_message(Finished& message);
  void on_message(Failed& message);
  void on_message(Cancelled& message);
  void on_message(Assign&) { end_worker("spoke as if it were the daemon", false); }
  void on_message(Look&) { end_worker("spoke as if it were the daemon", false); }
  void on_message(Cancel&) { end_worker("spoke as if it were the daemon", false); }

  queue::Queue& queue_;
  const SupervisorSettings settings_;
  const queue::Log log_;
  support::EventQueue<std::function<void()>> events_;

  // Any thread.
  std::atomic<std::uint64_t> wakes_{0};
  std::atomic<bool> suspects_came_{false};
  /// While the thread sleeps and nothing waits, though a place is free: the value of wakes_ at which that is so.
  static constexpr std::uint64_t no_offer = UINT64_MAX;
  std::atomic<std::uint64_t> offer_{no_offer};
  std::atomic<int> pid_{0};
  std::atomic<int> running_count_{0};
  std::atomic<std::uint64_t> kept_geometry_bytes_{0}, kept_image_bytes_{0};
  std::mutex status_mutex_;
  std::string status_ = "worker: starting";
  std::string sandbox_;  ///< what the latest worker told
  std::mutex drain_mutex_;

  // The loop's thread alone.
  std::unique_ptr<Worker> worker_;
  Life life_ = Life::absent;
  Time last_heard_, restart_at_{};
  std::chrono::milliseconds restart_pause_;
  std::uint64_t idle_memory_bytes_ = 0;         ///< of the worker before its first job
  std::unique_ptr<Worker> spare_;               ///< takes the worker's place at once when that is ended
  Time spare_at_{};                             ///< none is started before
  std::vector<std::unique_ptr<Worker>> ended_;  ///< killed; a large process takes its time to be gone

  std::map<std::string, Running> running_;
  std::size_t claiming_ = 0;             ///< claims at the store threads
  std::size_t claiming_any_ = 0;         ///< of those, perhaps of large jobs
  std::size_t found_in_a_row_ = 0;       ///< jobs, by the last claims
  std::size_t storing_ = 0;              ///< other tasks there
  std::set<std::string> early_cancels_;  ///< cancelled while claims are under way: perhaps one of those
  /// Values of wakes_ at which a claim found nothing to run, and nothing small.
  std::optional<std::uint64_t> found_nothing_, found_nothing_small_;
  bool suspects_first_ = true;  ///< there may be suspects, also from before a restart: they run before all others
  Time claims_paused_until_{};
  bool offered_ = false;  ///< offer_ was made, and not looked at since

  bool draining_ = false;
  bool gave_up_ = false;
  bool all_ended_ = true;
  Time drain_deadline_{};

  std::unique_ptr<StoreExecutor> store_threads_;
  std::thread thread_;  ///< last: starts when the rest is there
};

}  // namespace worker
