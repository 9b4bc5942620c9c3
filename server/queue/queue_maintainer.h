#pragma once
/// The queue's own threads: maintenance, and renewal of the leases of running jobs.

#include <chrono>
#include <utility>

#include "server/queue/job_lifecycle.h"
#include "server/queue/periodic_task.h"

namespace queue {

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
      : thread_("run_maintenance", std::move(log),
                [&jobs, settings] { return jobs.run_maintenance() ? settings.pause : settings.interval; }) {}

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

}  // namespace queue
