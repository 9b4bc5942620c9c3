#pragma once
/// Jobs that are about to be queued, while that is not told yet.

#include <string>
#include <utility>
#include <vector>

#include "server/jobs/queue.h"

namespace jobs {

/// Whoever first knows that they were queued, their submitter or someone who has claimed one already, tells so
/// (Queue::tell_queued): then no one hears that a job runs before hearing that it waits.
class Queue::Arrival {
 public:
  Arrival(Queue& queue, std::vector<std::string> ids) : queue_(queue), ids_(std::move(ids)) {
    const std::lock_guard lock(queue_.arrivals_mutex_);
    queue_.arrivals_.insert(ids_.begin(), ids_.end());
  }
  ~Arrival() {
    const std::lock_guard lock(queue_.arrivals_mutex_);
    for (const std::string& id : ids_) queue_.arrivals_.erase(id);  // told, or it did not happen
  }
  Arrival(const Arrival&) = delete;
  Arrival& operator=(const Arrival&) = delete;

 private:
  Queue& queue_;
  const std::vector<std::string> ids_;
};

}  // namespace jobs
