#pragma once
/// The interface of the queue to the runner of jobs.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/job_store.h"

namespace queue {

/// Work on finished images, for a client that waits.
struct ImageTask {
  std::uint32_t side = 0;  ///< pixels along the longer side of the result
  std::vector<std::shared_ptr<const ArtifactReader>> images;
};
struct ImageTaskResult {
  std::string failure;  ///< a sentence; empty: `bytes` is the result
  std::string bytes;    ///< a PNG
};

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
  /// Takes the free slot that the runner offers while no job waits; false where it offers none. Afterwards the caller
  /// returns it with the job that it has claimed, which is then run, or without one.
  virtual bool take_slot() noexcept { return false; }
  virtual void return_slot(std::optional<Claim>&& /*claim*/) noexcept {}
  /// Calls `done` once, from any thread.
  virtual void run_image_task(const ImageTask& /*task*/, const std::function<void(ImageTaskResult)>& done) noexcept {
    done({"images cannot be processed", {}});
  }
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
  void run_image_task(const ImageTask& task, const std::function<void(ImageTaskResult)>& done) {
    const std::shared_lock lock(mutex_);
    if (runner_ == nullptr) return done({"no worker runs", {}});
    runner_->run_image_task(task, done);
  }
  void notify(bool for_suspects = false) {
    call([&](JobRunner& runner) { runner.notify(for_suspects); });
  }

  /// The slot that a submission has taken, if the runner offers one. `attach` waits for its end; no other call of this
  /// thread to the runner is allowed until then.
  class Slot {
   public:
    explicit Slot(AttachedRunner& runner) : lock_(runner.mutex_), runner_(runner.runner_) {
      if (runner_ != nullptr && !runner_->take_slot()) runner_ = nullptr;
    }
    ~Slot() {
      if (runner_ != nullptr) runner_->return_slot(std::move(claim_));
    }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    [[nodiscard]] bool taken() const { return runner_ != nullptr; }
    void run(Claim claim) { claim_ = std::move(claim); }

   private:
    std::shared_lock<std::shared_mutex> lock_;
    JobRunner* runner_;
    std::optional<Claim> claim_;
  };

 private:
  std::shared_mutex mutex_;
  JobRunner* runner_ = nullptr;
};

}  // namespace queue
