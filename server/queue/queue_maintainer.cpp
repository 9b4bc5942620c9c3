#include "server/queue/queue_maintainer.h"

#include <utility>

namespace queue {

QueueMaintainer::QueueMaintainer(JobLifecycle& jobs, Log log, MaintenanceSettings settings)
    : thread_("run_maintenance", std::move(log),
              [&jobs, settings] { return jobs.run_maintenance() ? settings.pause : settings.interval; }) {}

LeaseRenewer::LeaseRenewer(JobLifecycle& jobs, Log log, std::chrono::milliseconds interval)
    : thread_("renew_leases", std::move(log), [&jobs, interval] {
        jobs.renew_leases();
        return interval;
      }) {}

}  // namespace queue
