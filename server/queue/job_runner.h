#pragma once
/// The runner of jobs, as the queue sees it.

#include <cstdint>
#include <mutex>
#include <shared_mutex>
#include <string>

#include "server/queue/job_store.h"

namespace queue {

/// Calls come from any thread, several at once; they return at once and do not call the queue.
class JobRunner {
 public:
  virtual ~JobRunner() = default;
  virtual void notify(bool for_suspects) noexcept = 0;      ///< there may be a job to claim, also suspects
  virtual void cancel(const std::string& id) noexcept = 0;  ///< stop this running job; unknown ids are ignored
  /// Make a preview of this running job, for JobWaiters::add_preview; unknown ids are ignored.
  virtual void request_preview(const std::string& id, std::uint32_t side) noexcept = 0;
  /// The claim is over: its lease ended, and the job may run elsewhere. Stop it; its end will not be stored.
  virtual void on_lease_lost(const Lease& lease) noexcept = 0;
  virtual std::string not_ready() = 0;  ///< empty when jobs would run now, else the reason: "worker: restarting"
};

/// The attached runner, if there is one. Thread-safe.
class AttachedRunner {
 public:
  /// Replaces the runner by another one or null; no call to the old one is in progress when this returns.
  void attach(JobRunner* runner) {
    const std::lock_guard lock(mutex_);
    runner_ = runner;
  }
  template <class Call>
  void call(Call call) {
    const std::shared_lock lock(mutex_);
    if (runner_ != nullptr) call(*runner_);
  }
  void notify(bool for_suspects = false) {
    call([&](JobRunner& runner) { runner.notify(for_suspects); });
  }

 private:
  std::shared_mutex mutex_;
  JobRunner* runner_ = nullptr;
};

}  // namespace queue
