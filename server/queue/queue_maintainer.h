#pragma once
/// The queue's own threads: one keeps house in it, one keeps the leases of the jobs that run here.

#include <chrono>

#include "server/queue/periodic_task.h"
#include "server/queue/queue.h"

namespace queue {

struct HousekeeperSettings {
  /// A run_after, a deadline or an expiry is kept to this; each round costs a read of a few indexes.
  std::chrono::milliseconds interval{250};
  /// Between steps while there is more to do: most of the writer's time is for others.
  std::chrono::milliseconds pause{20};
};

/// Ended leases, deadlines of waiting jobs, jobs that become due, expiry. `queue` must outlive it.
class QueueMaintainer {
 public:
  QueueMaintainer(Queue& queue, Log log, HousekeeperSettings settings = {});

 private:
  PeriodicTask thread_;
};

/// Renews the leases of running jobs, from a thread that waits for nothing else. Must live as long as jobs run; `queue`
/// must outlive it.
class LeaseRenewer {
 public:
  /// A third of QueueSettings::lease_ms: two renewals may fail. Jobs that end sooner cost none.
  static constexpr std::chrono::milliseconds default_interval{10'000};
  LeaseRenewer(Queue& queue, Log log, std::chrono::milliseconds interval = default_interval);

 private:
  PeriodicTask thread_;
};

}  // namespace queue
