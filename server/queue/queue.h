#pragma once
/// The queue: its parts, connected, over the stores.
///
///   storage::sqlite::SqliteStores stores(directory);               // server/storage/sqlite/sqlite_stores.h
///   storage::files::FileArtifactStore artifacts(directory);        // server/storage/files/file_stores.h
///   queue::IdSource ids(queue::system_clock(), queue::system_random());
///   queue::Queue queue(stores.all(), artifacts, ids, queue::system_clock(), log, settings);
///   worker::Supervisor supervisor(queue, worker_settings, log);    // server/worker/supervisor/supervisor.h
///   auto submitted = queue.submission.submit(submission);

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/artifact_pins.h"
#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/queue/disk_health.h"
#include "server/queue/event_log.h"
#include "server/queue/job.h"
#include "server/queue/job_notifications.h"
#include "server/queue/job_runner.h"
#include "server/queue/job_store.h"
#include "server/queue/job_waiters.h"
#include "tracer/result.h"

namespace queue {

struct QueueSettings {
  /// Most queued jobs; more are rejected. 100,000 small scenes are a night's batch and about 100 MB. Jobs that return
  /// from a dead worker were accepted before and are never rejected.
  std::int64_t queued_limit = 100'000;
  /// The same for one owner, and the bytes of all its images.
  std::int64_t owner_queued_limit = 100'000;
  std::int64_t owner_artifact_bytes_limit = std::int64_t{1} << 40;
  /// The first reply under an Idempotency-Key is repeated for this time.
  std::int64_t reply_kept_ms = std::int64_t{24} * 3600 * 1000;
  /// An expired job is kept, without document and images, for 30 days.
  Retention retention{.expired_ms = std::int64_t{30} * 24 * 3600 * 1000};
  /// A claimed job belongs to this daemon for this time without a renewal (renew_leases): longer than a disk stalls,
  /// shorter than a client's patience.
  std::int64_t lease_ms = 30'000;
  DiskSpaceProbe disk_space = [] { return DiskSpace{}; };
};

/// State that submission, life cycle and queries share.
struct QueueContext {
  QueueContext(const Stores& all_stores, ArtifactStore& artifacts, IdSource& id_source, Clock now, const Log& log,
               QueueSettings queue_settings)
      : stores(all_stores),
        ids(id_source),
        clock(std::move(now)),
        settings(std::move(queue_settings)),
        boot_id(ids.next()),
        pins(stores.maintenance, artifacts, log),
        waiters(stores.jobs, runner, clock),
        notifications(running, waiters) {}

  const Stores stores;
  IdSource& ids;
  const Clock clock;
  const QueueSettings settings;
  const std::string boot_id;  ///< identifies the claims of this daemon
  AttachedRunner runner;
  RunningJobs running;
  ThroughputEstimate throughput;
  ArtifactPins pins;
  JobWaiters waiters;
  JobNotifications notifications;
  ClusterStore* cluster = nullptr;  ///< null: there are no other nodes
  std::atomic<int> nodes = 1;       ///< number of nodes, about
};

/// Sets the position and the estimated time of a waiting job.
void add_position(QueueContext& context, JobView& view);

/// Submission of jobs: within the quotas, once for each Idempotency-Key, from the result cache where that has the
/// images. Thread-safe. Every call may throw StoreFailure.
class JobSubmission {
 public:
  explicit JobSubmission(QueueContext& context) : context_(context) {}

  /// Durable when it returns, unless the submission is not. With images in the result cache the job has succeeded
  /// already. A repeated request returns its first reply.
  tracer::Result<Submitted, Rejection> submit(Submission submission);
  /// Submits the jobs of a batch together, see submit(); a limit holds for all of them.
  tracer::Result<BatchSubmitted, Rejection> submit_batch(BatchSubmission submission);
  /// Makes a job that was submitted without durability durable, and its later images. The caller reads the job again
  /// afterwards: one that has ended meanwhile is not durable.
  void make_durable(const std::string& id);

 private:
  class QuotaReservation;
  std::optional<Rejection> reserve(const std::string& owner, std::int64_t jobs);
  bool finish_from_cache(Job& job, ArtifactPins::Pinned& pinned, bool durable);
  NewJob new_job(Submission submission, ArtifactPins::Pinned& pinned);
  void notify_stored(const Job& job);

  QueueContext& context_;
  std::mutex mutex_;
  std::map<std::string, std::int64_t> reserved_;  ///< jobs by owner: admitted, not yet counted by the store
};

/// The life of stored jobs: claims and ends by the runner, changes by the owner, maintenance in time. Thread-safe.
/// Every call may throw StoreFailure.
class JobLifecycle {
 public:
  /// Recovers the jobs that a dead daemon left running: they are queued again, the attempt not counted.
  JobLifecycle(QueueContext& context, const Log& log);

  // ---- for the runner. As JobTransitions, with this daemon's boot id and clock.

  /// Empty while the disk has no space for a result. Claims that an equal job makes unnecessary are not returned: such
  /// a job ends with the images that exist, or as soon as the equal one that runs has ended (RunningJobs::begin).
  std::optional<Claim> claim(const ClaimFilter& filter = {});
  struct Image {
    std::string name;        ///< "image.png"
    std::string media_type;  ///< "image/png"
    int fd = -1;             ///< read from offset 0; owned by the caller
  };
  /// Stores the images, then the row. False as JobTransitions::succeed; then no image remains that no job names.
  /// `figures`: those of the report, for observers.
  bool succeed(const std::string& id, std::int64_t fence, const std::string& report, const std::vector<Image>& images,
               const std::optional<api::ReportFigures>& figures = std::nullopt);
  bool fail(const std::string& id, std::int64_t fence, const Problem& problem);
  bool finish_cancel(const std::string& id, std::int64_t fence);
  bool release(const std::string& id, std::int64_t fence, const Release& release);
  /// Adds the file as preview.png to a job that failed or was cancelled; false as JobTransitions::add_artifact.
  bool keep_preview(const std::string& id, std::int64_t fence, int fd);
  /// `fraction` in [0,1]; smaller ones than before are ignored until the job is claimed again.
  void set_progress(const std::string& id, double fraction);
  /// The results so far of a running measurement, as its report.
  void set_measurement(const std::string& id, std::string summary) {
    context_.notifications.notify_measurement(id, summary);
    context_.running.set_measurement(id, std::move(summary));
  }
  /// Renews the leases of all jobs claimed and not ended here; the runner is notified of lost ones.
  void renew_leases();

  // ---- for owners. What is not `durable` becomes so with the next sync().

  CancelOutcome cancel(const std::string& id, bool durable = true);  ///< a running job is cancelled within 100 ms
  RemoveOutcome remove(const std::string& id, bool durable = true);
  /// See JobTransitions::retry(). A succeeded job is queued again if one of its images is missing or damaged.
  RetryOutcome retry(const std::string& id, bool durable = true);
  ChangeOutcome change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision,
                       bool durable = true);
  void sync() { context_.stores.maintenance.probe(); }
  void cancel_batch(const std::string& id);
  int retry_batch(const std::string& id);  ///< number of jobs that are queued again
  /// Removes the jobs that have ended, and the batch with the last one. True if it is gone.
  bool remove_batch(const std::string& id);

  // ---- for the daemon

  /// One small step: ended leases, deadlines, jobs that have become due, expiry. True when there is more to do at once.
  bool run_maintenance();
  /// Pause between two steps: that of one node, `interval`, for all nodes together.
  [[nodiscard]] std::chrono::milliseconds maintenance_pause(std::chrono::milliseconds interval);
  void on_disk_space_available() { context_.runner.notify(true); }

 private:
  bool finish(const Lease& lease, bool ended, const EndedJob& job);
  bool finish_as_duplicate(const Lease& lease, const std::string& content_key);
  void end_followers(const std::string& id);
  bool cancel_follower(const std::string& id);
  void seed_throughput_estimate();
  bool has_all_images(const Job& job);
  void collect(const std::vector<Artifact>& artifacts);  ///< deletes those that no job names
  void cancel_failing_batch(const std::string& job_id);
  std::vector<Artifact> store_images(ArtifactPins::Pinned& pinned, const std::vector<Image>& images, bool durable);

  QueueContext& context_;
  std::int64_t maintained_at_ = 0;  ///< time of the last step
  std::int64_t pause_ms_ = 0;       ///< after it
  std::int64_t grace_until_ = 0;    ///< until then no lease is taken back
};

struct QueueState {
  QueueDepth depth;
  std::map<JobState, std::int64_t> jobs;  ///< all of them, by state
  std::optional<double> oldest_age_s;     ///< age of the oldest job that may run now
  /// Time until all jobs without not_before have ended, by their Job::work; empty until a job has succeeded.
  std::optional<double> eta_s;
};

/// Reads of jobs, batches and the queue. Thread-safe. Every call may throw StoreFailure.
class JobQueries {
 public:
  explicit JobQueries(QueueContext& context) : context_(context) {}

  std::optional<JobView> find(const std::string& id);
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit);
  double progress(const std::string& id) { return context_.running.progress(id); }
  /// See ThroughputEstimate.
  std::optional<double> seconds_per_work() { return context_.throughput.seconds_per_work(); }
  std::vector<JobMove> moves(const std::string& id) { return context_.stores.jobs.moves(id); }
  std::optional<BatchState> find_batch(const std::string& id) { return context_.stores.batches.find(id); }
  /// The complete document of a job; none if it is unknown or has expired.
  std::optional<std::string> document(const std::string& id);
  /// Use and limits of an owner.
  OwnerUsage owner_usage(const std::string& owner) { return context_.stores.statistics.owner_usage(owner); }
  [[nodiscard]] OwnerUsage owner_quota() const {
    return {context_.settings.owner_queued_limit, context_.settings.owner_artifact_bytes_limit};
  }
  BatchPage list_batches(const std::string& cursor, int limit) { return context_.stores.batches.list(cursor, limit); }
  QueueState state();
  [[nodiscard]] DiskSpace disk_space() const { return context_.settings.disk_space(); }
  /// See ArtifactPins.
  std::unique_ptr<ArtifactReader> open(const Artifact& artifact, bool verified = true) {
    return context_.pins.open(artifact, verified);
  }

  /// For readiness: empty, or the reason ("store: disk full", "worker: restarting", "draining"). Costs a small durable
  /// write, so about once a second is often enough.
  std::string not_ready();

 private:
  QueueContext& context_;
};

/// The stores and `ids` must outlive it.
class Queue {
 private:
  QueueContext context_;

 public:
  Queue(const Stores& stores, ArtifactStore& artifacts, IdSource& ids, Clock clock, const Log& log,
        QueueSettings settings)
      : context_(stores, artifacts, ids, std::move(clock), log, std::move(settings)), lifecycle(context_, log) {}

  /// Once, before jobs are submitted or run: other nodes use the same stores. Both must outlive this; see NodeLink.
  void connect(Wakeups& wakeups, ClusterStore& cluster) {
    context_.runner.connect(&wakeups);
    context_.cluster = &cluster;
  }
  void set_nodes(int nodes) { context_.nodes = nodes; }
  /// Identifies the claims of this daemon.
  [[nodiscard]] const std::string& boot_id() const { return context_.boot_id; }

  AttachedRunner& runner = context_.runner;
  JobNotifications& notifications = context_.notifications;
  JobWaiters& waiters = context_.waiters;
  JobSubmission submission{context_};
  JobLifecycle lifecycle;
  JobQueries queries{context_};
};

}  // namespace queue
