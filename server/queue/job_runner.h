#pragma once
/// Who runs jobs, as the queue sees it. The calls are made from any thread, several at once, and return at once; from
/// within none but on_job_available may call the queue back, and that only to claim.

#include <cstdint>
#include <string>

#include "server/queue/job_store.h"

namespace queue {

class JobRunner {
 public:
  virtual ~JobRunner() = default;
  virtual void wake(bool for_suspects) noexcept = 0;  ///< there may be something to claim; suspects, too
  /// One job has come that may be claimed: a runner with a place for it may do so at once, on the submitter's thread.
  virtual void on_job_available() noexcept { wake(false); }
  virtual void cancel(const std::string& id) noexcept = 0;  ///< this running job is to stop; unknown ids are ignored
  /// Somebody wants to see how far this running job is: Queue::previewed follows, perhaps; unknown ids are ignored.
  virtual void look(const std::string& id, std::uint32_t side) noexcept = 0;
  /// This claim is over: its lease ended, and the job may run elsewhere. It is to stop, and nobody asks how it ended.
  virtual void lost(const Lease& lease) noexcept = 0;
  virtual std::string not_ready() = 0;  ///< empty when jobs would run now, else why not: "worker: restarting"
};

}  // namespace queue
