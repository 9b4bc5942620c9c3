#include "server/queue/queue_maintainer.h"

#include <utility>

namespace queue {

QueueMaintainer::QueueMaintainer(Queue& queue, Log log, HousekeeperSettings settings)
    : thread_("run_maintenance", std::move(log),
              [&queue, settings] { return queue.run_maintenance() ? settings.pause : settings.interval; }) {}

LeaseRenewer::LeaseRenewer(Queue& queue, Log log, std::chrono::milliseconds interval)
    : thread_("renew_leases", std::move(log), [&queue, interval] {
        queue.renew_leases();
        return interval;
      }) {}

}  // namespace queue
