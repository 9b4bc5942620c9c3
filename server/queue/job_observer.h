#pragma once
/// An observer of all jobs. Calls come from any thread, after the change is durable; they return at once and do not
/// call the queue.

#include <string>

#include "server/queue/job.h"

namespace queue {

class JobObserver {
 public:
  virtual ~JobObserver() = default;
  /// Also to queued, when the job is new.
  virtual void on_state_changed(const std::string& id, JobState to) noexcept = 0;
  /// After on_state_changed to an end, when all waiters for the job were called: the place for slower work.
  virtual void on_waiters_notified(const std::string& /*id*/) noexcept {}
  virtual void on_progress(const std::string& id, double fraction) noexcept = 0;
  virtual void on_removed(const std::string& id) noexcept = 0;
};

}  // namespace queue
