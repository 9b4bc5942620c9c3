#include "server/jobs/asset_collector.h"

#include <exception>
#include <utility>

namespace jobs {

int collect_assets(AssetStore& assets, JobStore& store, int part, std::int64_t unused_since) {
  int removed = 0;
  for (const std::string& sha256 : assets.unused_since(part, unused_since)) {
    // In this order: a job that comes in between has used the asset first, and then it stays.
    if (!store.names_asset(sha256) && assets.remove_unused_since(sha256, unused_since)) ++removed;
  }
  return removed;
}

AssetCollector::AssetCollector(AssetStore& assets, JobStore& store, Clock clock, Log log, CollectorSettings settings)
    : assets_(assets),
      store_(store),
      clock_(std::move(clock)),
      log_(std::move(log)),
      settings_(settings),
      thread_([this] { run(); }) {}

AssetCollector::~AssetCollector() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  thread_.join();
}

void AssetCollector::run() {
  for (;;) {
    for (int part = 0; part < AssetStore::parts; ++part) {
      step(part);
      if (stopped_after(settings_.step_pause)) return;
    }
    if (stopped_after(settings_.round_pause)) return;
  }
}

void AssetCollector::step(int part) noexcept {
  try {
    const int removed = collect_assets(assets_, store_, part, clock_() - settings_.age.count());
    if (removed > 0) log_(LogLevel::info, "assets_collected", {{"count", std::to_string(removed)}});
  } catch (const std::exception& failure) {
    log_(LogLevel::warning, "assets_not_collected", {{"detail", failure.what()}});
  }
}

bool AssetCollector::stopped_after(std::chrono::milliseconds pause) {
  std::unique_lock lock(mutex_);
  return stop_.wait_for(lock, pause, [this] { return stopping_; });
}

}  // namespace jobs
