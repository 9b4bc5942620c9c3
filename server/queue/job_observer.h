#pragma once
/// Who is told what happens to jobs, as the queue sees it. The calls are made from any thread, after the fact is
/// durable, must return at once and must not call the queue back from within.

#include <string>

#include "server/queue/job.h"

namespace queue {

class Observer {
 public:
  virtual ~Observer() = default;
  virtual void on_state_changed(const std::string& id,
                                JobState to) noexcept = 0;  ///< also into the queue, when it is new
  /// After moved to an end, when all who waited for it have been called: the time for what takes longer.
  virtual void on_waiters_notified(const std::string& /*id*/) noexcept {}
  virtual void progressed(const std::string& id, double fraction) noexcept = 0;
  virtual void removed(const std::string& id) noexcept = 0;
};

}  // namespace queue
