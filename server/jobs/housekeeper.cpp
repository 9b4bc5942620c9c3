#include "server/jobs/housekeeper.h"

#include <utility>

namespace jobs {

Housekeeper::Housekeeper(Queue& queue, Log log, HousekeeperSettings settings)
    : thread_("keep_house", std::move(log),
              [&queue, settings] { return queue.keep_house() ? settings.pause : settings.interval; }) {}

LeaseKeeper::LeaseKeeper(Queue& queue, Log log, std::chrono::milliseconds interval)
    : thread_("renew_leases", std::move(log), [&queue, interval] {
        queue.renew_leases();
        return interval;
      }) {}

}  // namespace jobs
