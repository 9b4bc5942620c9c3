#pragma once
/// The queue: what the HTTP room asks (JobService) and what the worker's supervisor asks (the second half), over a
/// JobStore and an ArtifactStore. It adds what the stores do not know: the bound on waiting jobs, progress, who waits
/// for an end, and which bytes may be deleted.
///
///   queue::SqliteJobStore store(directory, log);               // server/storage/sqlite/sqlite_job_store.h
///   queue::FileArtifactStore artifacts(directory);             // server/storage/files/file_artifact_store.h
///   queue::IdSource ids(queue::system_clock(), queue::system_random());
///   queue::Queue queue(store, artifacts, ids, queue::system_clock(), log, settings);
///   worker::Supervisor supervisor(queue, worker_settings, log);  // server/worker/supervisor.h
///   ... serve HTTP from `queue` as a JobService; stop HTTP before the supervisor goes ...

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "server/queue/artifact_pins.h"
#include "server/queue/artifact_store.h"
#include "server/queue/clock.h"
#include "server/queue/completion_listener.h"
#include "server/queue/disk_space.h"
#include "server/queue/event_log.h"
#include "server/queue/job_id.h"
#include "server/queue/job_observer.h"
#include "server/queue/job_runner.h"
#include "server/queue/job_service.h"
#include "server/queue/job_store.h"
#include "server/queue/previews.h"

namespace queue {

struct QueueSettings {
  /// Jobs waiting to run; more are refused with QueueFull. 100,000 small scenes are a night's batch and about 100 MB.
  /// Jobs that come back from a dead worker were accepted before and are never refused.
  std::int64_t queued_limit = 100'000;
  /// The same for one owner, and the bytes of all its images.
  std::int64_t owner_queued_limit = 100'000;
  std::int64_t owner_artifact_bytes_limit = std::int64_t{1} << 40;
  /// How long the first reply under an Idempotency-Key is given again.
  std::int64_t reply_kept_ms = std::int64_t{24} * 3600 * 1000;
  /// How long an expired job can still be asked what became of it.
  std::int64_t expired_kept_ms = std::int64_t{30} * 24 * 3600 * 1000;
  /// How long a claimed job stays this daemon's without a renewal (LeaseRenewer): a disk that hangs is forgiven, and
  /// other daemons on the same store wait no longer than a client's patience.
  std::int64_t lease_ms = 30'000;
  /// Images up to this are stored in the transaction that ends their job, which then syncs once instead of three
  /// times and makes no file; larger ones would hold the one writer up. SQLite reads and writes blobs faster than files
  /// up to about 100 KB (sqlite.org/intern-v-extern-blob.html).
  std::size_t small_image_bytes = 32u << 10;
};

/// Thread-safe. The stores, and `ids`, must outlive it. Every call may throw StoreFailure where the stores do.
class Queue final : public JobService {
 public:
  /// Takes over the jobs that a dead daemon left running: they are queued again, with their attempt given back.
  Queue(JobStore& store, ArtifactStore& artifacts, IdSource& ids, Clock clock, const Log& log, QueueSettings settings);

  tracer::Result<Submitted, Refused> submit(Submission submission) override;
  std::optional<JobView> find(const std::string& id) override;
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit) override;
  double progress(const std::string& id) override;
  CancelOutcome cancel(const std::string& id) override;
  RemoveOutcome remove(const std::string& id) override;
  RetryOutcome retry(const std::string& id) override;
  ChangeOutcome change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision) override;
  QueueState state() override;
  tracer::Result<BatchSubmitted, Refused> submit_batch(BatchSubmission submission) override;
  std::optional<BatchState> find_batch(const std::string& id) override;
  void cancel_batch(const std::string& id) override;
  int retry_batch(const std::string& id) override;
  void make_durable(const std::string& id) override;
  std::unique_ptr<ArtifactReader> open(const Artifact& artifact) override;
  std::uint64_t when_ended(const std::string& id, std::function<void()> done) override;
  void forget(std::uint64_t token) override;
  Previews::Latest preview(const std::string& id, std::uint32_t side) override { return previews_.latest(id, side); }
  std::uint64_t look(const std::string& id, std::uint32_t side, std::function<void()> done) override;
  void cancel_preview(std::uint64_t token) override { previews_.forget(token); }
  std::string not_ready() override;

  // ---- for whoever runs jobs -----------------------------------------------------------------------------------

  /// `runner` is told of new and of cancelled jobs until another one, or null, is attached. A call in progress has
  /// ended when this returns.
  void attach(JobRunner* runner);

  /// `observer` is told of every move from now on. Once, before jobs are submitted or run; must outlive this.
  void observe(Observer* observer) { observer_ = observer; }

  /// `listener` is told of the webhooks that jobs ask for, and of every end, until another one, or null, is given. It
  /// must live until no call is in progress any more.
  void set_completion_listener(CompletionListener* listener) { listener_ = listener; }

  /// `room` tells what the disk has room for. Once, before jobs are submitted or run; unset: there is enough.
  void set_disk_probe(DiskSpaceProbe room) { room_ = std::move(room); }
  /// There is room again for jobs to be begun.
  void on_disk_space_available() { wake_runner(true); }

  /// As JobStore, with this daemon's boot id and clock. Those that end the job call the waiters. Nothing is claimed
  /// while the disk has no room for what would come of it.
  std::optional<Claim> claim(bool alone);
  std::optional<Claim> claim_small();
  bool fail(const std::string& id, std::int64_t fence, const Problem& problem);
  bool finish_cancel(const std::string& id, std::int64_t fence);
  /// `pause_ms`: it is not claimed again before.
  bool release(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::int64_t pause_ms = 0);

  struct Image {
    std::string name;        ///< "image.png"
    std::string media_type;  ///< "image/png"
    int fd = -1;             ///< its bytes, read from offset 0; stays the caller's
  };
  /// Bytes first or with the row: when the row is there, so are the images. False as JobStore::succeed; then nothing
  /// of the images stays that no other job names.
  bool succeed(const std::string& id, std::int64_t fence, const std::string& report, const std::vector<Image>& images);

  /// `fraction` in [0,1]; smaller ones than before are ignored until the job is claimed again.
  void progressed(const std::string& id, double fraction);

  /// What a running job looks like. Of others it is not kept.
  void previewed(const std::string& id, std::uint32_t side, std::string png);

  /// Renews the leases of all jobs claimed and not ended here; the runner is told of those that were taken back.
  void renew_leases();

  // ---- for whoever keeps house (housekeeper.h)
  // -----------------------------------------------------------------------

  /// One small step: ended leases, deadlines, jobs that have become due, expiry. True when there is more to do at once.
  bool run_maintenance();

 private:
  bool has_no_room() const;
  std::optional<Claim> began(std::optional<Claim> claim);
  void job_ended(const std::string& id);
  void expect_webhook(const Job& job);
  void notify_arrived(const Job& job);
  void tell(const std::string& id, JobState to);
  void tell_end(const std::string& id, JobState state);
  void note_end();
  bool is_durable(const std::string& id);
  void let_go(const std::string& id, std::int64_t fence);
  void wake_runner(bool for_suspects = false);
  void tell_runner_of_one();

  /// A job that is about to be queued. Whoever first knows that it was, its submitter or someone who has claimed it
  /// already, tells so: then no one hears that it runs before hearing that it waits.
  class PendingAnnouncement;
  void notify_queued(const std::string& id);
  void notify_given_back(const std::string& id, std::optional<PendingAnnouncement>& arrival);
  JobView view(Job job);
  Job job_of(const Submission& submission);
  bool finish_from_cache(Job& job, ArtifactPins::Pinned& pinned);
  NewJob new_job(Submission submission, ArtifactPins::Pinned& pinned);
  void stop_where_too_many_failed(const std::string& job_id);
  std::optional<Refused> enter(const std::string& owner, std::int64_t jobs);
  void leave(const std::string& owner, std::int64_t jobs);
  class InsertResult;

  JobStore& store_;
  IdSource& ids_;
  Clock clock_;
  QueueSettings settings_;
  std::string boot_id_;
  ArtifactPins pins_;
  Previews previews_;

  std::mutex submit_mutex_;
  std::map<std::string, std::int64_t> submitting_;  ///< by owner: admitted, not yet counted by the store

  std::atomic<CompletionListener*> listener_ = nullptr;

  std::shared_mutex runner_mutex_;  ///< alone: who attaches, so that no call is in progress
  JobRunner* runner_ = nullptr;
  Observer* observer_ = nullptr;
  DiskSpaceProbe room_;
  std::mutex arrivals_mutex_;  ///< held while an arrival is told
  std::unordered_set<std::string> arrivals_;

  std::mutex live_mutex_;  ///< progress and waiters; never held over a call of the store or of a waiter
  std::unordered_map<std::string, double> progress_;
  std::unordered_map<std::string, std::int64_t> leases_;  ///< of jobs claimed here: id to fence
  std::unordered_set<std::string> not_durable_;           ///< as submitted; they have not ended
  struct Waiter {
    std::string id;
    std::function<void()> done;
  };
  std::map<std::uint64_t, Waiter> waiters_;                          ///< by token
  std::unordered_multimap<std::string, std::uint64_t> waiting_for_;  ///< job id to tokens
  std::uint64_t last_token_ = 0;
  std::deque<std::int64_t> recent_ends_;  ///< when jobs that ran ended
};

}  // namespace queue
