#pragma once
/// Settings and state that submission, life cycle and queries of jobs share.

#include <cstdint>
#include <string>
#include <utility>

#include "server/queue/artifact_pins.h"
#include "server/queue/clock.h"
#include "server/queue/disk_space.h"
#include "server/queue/event_log.h"
#include "server/queue/job_id.h"
#include "server/queue/job_notifications.h"
#include "server/queue/job_runner.h"
#include "server/queue/job_store.h"
#include "server/queue/job_waiters.h"
#include "server/queue/running_jobs.h"

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
  /// An expired job is kept, without document and images, for this time.
  std::int64_t expired_kept_ms = std::int64_t{30} * 24 * 3600 * 1000;
  /// A claimed job belongs to this daemon for this time without a renewal (LeaseRenewer): longer than a disk stalls,
  /// shorter than a client's patience.
  std::int64_t lease_ms = 30'000;
  DiskSpaceProbe disk_space = [] { return DiskSpace{}; };
};

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
  ArtifactPins pins;
  JobWaiters waiters;
  JobNotifications notifications;
};

}  // namespace queue
