#pragma once
/// The queue's own threads: maintenance, renewal of the leases of running jobs, and deletion of unused assets. The end
/// of a thread waits for the step in progress.

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"
#include "server/queue/queue.h"

namespace queue {

/// A thread that repeats a small step. `step` returns the pause before the next one; it may throw. Failures are logged
/// as "store_failure" during `name`, once until a step succeeds again, and the next step follows after a quarter of a
/// second.
std::jthread repeat(std::string name, Log log, std::function<std::chrono::milliseconds()> step);

struct MaintenanceSettings {
  /// Accuracy of run_after, deadlines and expiry; each round costs a read of a few indexes.
  std::chrono::milliseconds interval{250};
  /// Between steps while there is more to do, so that the writer serves others most of the time.
  std::chrono::milliseconds pause{20};
};

/// Calls JobLifecycle::run_maintenance. `jobs` must outlive it.
std::jthread maintain(JobLifecycle& jobs, Log log, MaintenanceSettings settings = {});

/// Calls JobLifecycle::renew_leases, from a thread that waits for nothing else. Must live as long as jobs run; `jobs`
/// must outlive it. The default is a third of QueueSettings::lease_ms: two renewals may fail. Jobs that end sooner cost
/// none.
std::jthread renew_leases(JobLifecycle& jobs, Log log, std::chrono::milliseconds interval = std::chrono::seconds(10));

// ---- assets

struct CollectorSettings {
  std::chrono::milliseconds age{std::chrono::days(30)};  ///< assets unused for longer are deleted
  std::chrono::milliseconds step_pause{20};              ///< one part of the store at a time, so a round takes 5 s
  std::chrono::milliseconds round_pause{std::chrono::hours(1)};
};

/// Collects in one part of the store (0 <= `part` < AssetStore::parts); number of deleted assets. Throws StoreFailure.
int collect_assets(AssetStore& assets, MaintenanceStore& references, int part, std::int64_t unused_since);

/// Deletes uploaded assets that no job names and that were not used for some time, a few at a time.
///
/// A submission calls AssetStore::use for its assets, then stores the job with their names. Between the two an asset
/// is young, afterwards it is named; the collector deletes only assets that are neither, so it never deletes one that a
/// job needs, as long as a submission takes less than the age.
///
/// A thread collects round after round; a part that fails is left to the next round. The stores must outlive it.
std::jthread collect_assets(AssetStore& assets, MaintenanceStore& references, Clock clock, const Log& log,
                            CollectorSettings settings);

}  // namespace queue
