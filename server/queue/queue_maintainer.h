#pragma once
/// The queue's own threads: maintenance, renewal of the leases of running jobs, and deletion of unused assets.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"
#include "server/queue/queue.h"

namespace queue {

/// A thread that repeats a small step with pauses between.
class PeriodicTask {
 public:
  using Pause = std::chrono::milliseconds;
  /// `step` returns the pause before the next one; it may throw. Failures are logged as "store_failure" during `name`,
  /// once until a step succeeds again, and the next step follows after a quarter of a second.
  PeriodicTask(std::string name, Log log, std::function<Pause()> step);
  ~PeriodicTask();  ///< after the step in progress
  PeriodicTask(const PeriodicTask&) = delete;
  PeriodicTask& operator=(const PeriodicTask&) = delete;

 private:
  void run();

  const std::string name_;
  const Log log_;
  const std::function<Pause()> step_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;  ///< last: it uses all other members
};

struct MaintenanceSettings {
  /// Accuracy of run_after, deadlines and expiry; each round costs a read of a few indexes.
  std::chrono::milliseconds interval{250};
  /// Between steps while there is more to do, so that the writer serves others most of the time.
  std::chrono::milliseconds pause{20};
};

/// Calls JobLifecycle::run_maintenance. `jobs` must outlive it.
class QueueMaintainer {
 public:
  QueueMaintainer(JobLifecycle& jobs, Log log, MaintenanceSettings settings = {})
      : thread_("run_maintenance", std::move(log), [&jobs, settings] {
          return jobs.run_maintenance() ? settings.pause : jobs.maintenance_pause(settings.interval);
        }) {}

 private:
  PeriodicTask thread_;
};

/// Calls JobLifecycle::renew_leases, from a thread that waits for nothing else. Must live as long as jobs run; `jobs`
/// must outlive it.
class LeaseRenewer {
 public:
  /// A third of QueueSettings::lease_ms: two renewals may fail. Jobs that end sooner cost none.
  static constexpr std::chrono::milliseconds default_interval{10'000};
  LeaseRenewer(JobLifecycle& jobs, Log log, std::chrono::milliseconds interval = default_interval)
      : thread_("renew_leases", std::move(log), [&jobs, interval] {
          jobs.renew_leases();
          return interval;
        }) {}

 private:
  PeriodicTask thread_;
};

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
class AssetCollector {
 public:
  AssetCollector(AssetStore& assets, MaintenanceStore& references, Clock clock, const Log& log,
                 CollectorSettings settings);

 private:
  std::chrono::milliseconds step(const Log& log);

  AssetStore& assets_;
  MaintenanceStore& references_;
  Clock clock_;
  CollectorSettings settings_;
  int part_ = 0;         ///< the next one
  PeriodicTask thread_;  ///< last: it uses all other members
};

}  // namespace queue
