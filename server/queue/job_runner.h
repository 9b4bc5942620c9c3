#pragma once
/// The interface of the queue to the runner of jobs.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/job_store.h"
#include "server/queue/wakeups.h"

namespace queue {

/// Work on finished images or a scene, for a client that waits.
struct ImageWork {
  /// "scale" one image; "view" a layer of one; "compare" two: a Comparison and, if wanted, its heat map; "live": the
  /// live form of a scene (api/live_json.h).
  std::string kind{"scale"};
  std::uint32_t side = 0;         ///< pixels along the longer side of the PNG that results, at most image_side_max
  std::vector<double> tolerance;  ///< levels, for a comparison; at most one
  bool heat = false;              ///< draw the heat map of a comparison, or numbers of a view in its colors
  std::uint8_t layer = 0;         ///< tracer::ViewedLayer, for a view; the rest as tracer::View, empty if unset
  double exposure = 0;
  std::vector<double> range;
  std::vector<std::uint32_t> crop;
  std::string document{};  ///< the scene, for a live form
};
inline constexpr std::uint32_t image_side_min = 16;  ///< smaller ones show nothing
/// The PNG of an image of noise with this side has 12.6 MB; a message of the worker has at most 16 MiB.
inline constexpr std::uint32_t image_side_max = 2048;

struct ImageTask {
  ImageWork work;
  std::vector<std::shared_ptr<const ArtifactReader>> images;
};
struct ImageTaskResult {
  std::string failure;  ///< a sentence; empty: there is a result
  std::string bytes;    ///< a PNG, or a live form
  std::string text{};   ///< a comparison as JSON (api::write_comparison)
  std::string code{};   ///< set if a repetition fails too: one of those below
};
inline constexpr std::string_view images_differ = "images_differ", bad_image = "bad_image",
                                  image_not_found = "image_not_found", bad_scene = "bad_scene";

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
  /// Calls `done` once, from any thread.
  virtual void run_image_task(const ImageTask& /*task*/, const std::function<void(ImageTaskResult)>& done) noexcept {
    done({"images cannot be processed", {}});
  }
  virtual std::string not_ready() = 0;  ///< empty when jobs would run now, else the reason: "worker: restarting"
};

/// Messages to the runners of other nodes (Wakeups). The id is that of the job; a preview has its side after a blank,
/// and `job_available` has the id "any".
namespace topics {
inline constexpr std::string_view job_available = "job_available", cancel = "cancel", preview = "preview";
}

/// The attached runner, if there is one, and those of other nodes. Thread-safe.
class AttachedRunner {
 public:
  /// Once, before jobs are submitted or run; must outlive all calls. Without it there are no other nodes.
  void connect(Wakeups* wakeups) { wakeups_ = wakeups; }
  [[nodiscard]] bool is_connected() const { return wakeups_ != nullptr; }

  /// Replaces the runner by another one or null; no call to the old one is in progress when this returns.
  void attach(JobRunner* runner) {
    const std::lock_guard lock(mutex_);
    runner_ = runner;
  }
  /// Calls the runner of this node.
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

  // ---- The job may run on any node.
  void notify(bool for_suspects = false) {
    call([&](JobRunner& runner) { runner.notify(for_suspects); });
    if (wakeups_ != nullptr) wakeups_->publish(topics::job_available, "any");
  }
  void cancel(const std::string& id) {
    call([&](JobRunner& runner) { runner.cancel(id); });
    if (wakeups_ != nullptr) wakeups_->publish(topics::cancel, id);
  }
  void request_preview(const std::string& id, std::uint32_t side) {
    call([&](JobRunner& runner) { runner.request_preview(id, side); });
    if (wakeups_ != nullptr) wakeups_->publish(topics::preview, id + " " + std::to_string(side));
  }

 private:
  std::shared_mutex mutex_;
  JobRunner* runner_ = nullptr;
  Wakeups* wakeups_ = nullptr;
};

}  // namespace queue
