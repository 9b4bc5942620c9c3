#pragma once
/// Jobs that are about to be queued, while that is not told yet.

#include <string>
#include <utility>
#include <vector>

#include "server/queue/queue.h"

namespace queue {

/// Whoever first knows that they were queued, their submitter or someone who has claimed one already, tells so
/// (Queue::notify_queued): then no one hears that a job runs before hearing that it waits.
class Queue::PendingAnnouncement {
 public:
  PendingAnnouncement(Queue& queue, std::vector<std::string> ids) : queue_(queue), ids_(std::move(ids)) {
    const std::lock_guard lock(queue_.arrivals_mutex_);
    queue_.arrivals_.insert(ids_.begin(), ids_.end());
  }
  ~PendingAnnouncement() {
    const std::lock_guard lock(queue_.arrivals_mutex_);
    for (const std::string& id : ids_) queue_.arrivals_.erase(id);  // told, or it did not happen
  }
  PendingAnnouncement(const PendingAnnouncement&) = delete;
  PendingAnnouncement& operator=(const PendingAnnouncement&) = delete;

 private:
  Queue& queue_;
  const std::vector<std::string> ids_;
};

}  // namespace queue
