#include "server/queue/queue_maintainer.h"

#include <exception>
#include <string>
#include <utility>

namespace queue {
namespace {

constexpr PeriodicTask::Pause pause_after_failure{250};

}  // namespace

PeriodicTask::PeriodicTask(std::string name, Log log, std::function<Pause()> step)
    : name_(std::move(name)), log_(std::move(log)), step_(std::move(step)), thread_([this] { run(); }) {}

PeriodicTask::~PeriodicTask() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_one();
  thread_.join();
}

void PeriodicTask::run() {
  std::unique_lock lock(mutex_);
  bool failing = false;
  while (!stopping_) {
    lock.unlock();
    Pause pause = pause_after_failure;
    try {
      pause = step_();
      failing = false;
    } catch (const std::exception& failure) {
      if (!failing) log_(LogLevel::error, "store_failure", {{"during", name_}, {"detail", failure.what()}});
      failing = true;
    }
    lock.lock();
    stop_.wait_for(lock, pause, [&] { return stopping_; });
  }
}

// ---- assets

int collect_assets(AssetStore& assets, MaintenanceStore& references, int part, std::int64_t unused_since) {
  int removed = 0;
  for (const std::string& sha256 : assets.unused_since(part, unused_since)) {
    // In this order: a job that is stored in between has used the asset first, so it is not removed.
    if (!references.is_asset_referenced(sha256) && assets.remove_unused_since(sha256, unused_since)) ++removed;
  }
  return removed;
}

AssetCollector::AssetCollector(AssetStore& assets, MaintenanceStore& references, Clock clock, const Log& log,
                               CollectorSettings settings)
    : assets_(assets),
      references_(references),
      clock_(std::move(clock)),
      settings_(settings),
      thread_("collect_assets", log, [this, log] { return step(log); }) {}

std::chrono::milliseconds AssetCollector::step(const Log& log) {
  const int part = std::exchange(part_, (part_ + 1) % AssetStore::parts);
  const int removed = collect_assets(assets_, references_, part, clock_() - settings_.age.count());
  if (removed > 0) log(LogLevel::info, "assets_collected", {{"count", std::to_string(removed)}});
  return part_ == 0 ? settings_.round_pause : settings_.step_pause;
}

}  // namespace queue
