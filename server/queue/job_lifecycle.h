#pragma once
/// The life of stored jobs: claims and ends by the runner, changes by the owner, maintenance in time.

#include <optional>
#include <string>
#include <vector>

#include "server/queue/queue_context.h"

namespace queue {

/// Thread-safe. Every call may throw StoreFailure.
class JobLifecycle {
 public:
  /// Recovers the jobs that a dead daemon left running: they are queued again, the attempt not counted.
  JobLifecycle(QueueContext& context, const Log& log);

  // ---- for the runner. As JobTransitions, with this daemon's boot id and clock.

  /// Empty while the disk has no space for a result.
  std::optional<Claim> claim(bool suspects, bool small = false);
  struct Image {
    std::string name;        ///< "image.png"
    std::string media_type;  ///< "image/png"
    int fd = -1;             ///< read from offset 0; owned by the caller
  };
  /// Stores the images, then the row. False as JobTransitions::succeed; then no image remains that no job names.
  bool succeed(const std::string& id, std::int64_t fence, const std::string& report, const std::vector<Image>& images);
  bool fail(const std::string& id, std::int64_t fence, const Problem& problem);
  bool finish_cancel(const std::string& id, std::int64_t fence);
  /// The job is not claimed again within `pause_ms`.
  bool release(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::int64_t pause_ms = 0);
  /// `fraction` in [0,1]; smaller ones than before are ignored until the job is claimed again.
  void set_progress(const std::string& id, double fraction);
  /// Renews the leases of all jobs claimed and not ended here; the runner is notified of lost ones.
  void renew_leases();

  // ---- for owners

  CancelOutcome cancel(const std::string& id);  ///< a running job becomes cancelled within 100 ms
  RemoveOutcome remove(const std::string& id);
  RetryOutcome retry(const std::string& id);
  ChangeOutcome change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision);
  void cancel_batch(const std::string& id);
  int retry_batch(const std::string& id);  ///< number of jobs that are queued again

  // ---- for the daemon

  /// One small step: ended leases, deadlines, jobs that have become due, expiry. True when there is more to do at once.
  bool run_maintenance();
  void on_disk_space_available() { context_.runner.notify(true); }

 private:
  void cancel_failing_batch(const std::string& job_id);
  std::vector<Artifact> store_images(ArtifactPins::Pinned& pinned, const std::vector<Image>& images, bool durable);

  QueueContext& context_;
};

}  // namespace queue
