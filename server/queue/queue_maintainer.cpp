#include "server/queue/queue_maintainer.h"

#include <condition_variable>
#include <exception>
#include <mutex>
#include <stop_token>
#include <utility>

namespace queue {

std::jthread repeat(std::string name, Log log, std::function<std::chrono::milliseconds()> step) {
  return std::jthread(
      [name = std::move(name), log = std::move(log), step = std::move(step)](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any stopped;
        bool failing = false;
        while (!stop.stop_requested()) {
          std::chrono::milliseconds pause{250};
          try {
            pause = step();
            failing = false;
          } catch (const std::exception& failure) {
            if (!failing) log(LogLevel::error, "store_failure", {{"during", name}, {"detail", failure.what()}});
            failing = true;
          }
          std::unique_lock lock(mutex);
          stopped.wait_for(lock, stop, pause, [] { return false; });
        }
      });
}

std::jthread maintain(JobLifecycle& jobs, Log log, MaintenanceSettings settings) {
  return repeat("run_maintenance", std::move(log), [&jobs, settings] {
    return jobs.run_maintenance() ? settings.pause : jobs.maintenance_pause(settings.interval);
  });
}

std::jthread renew_leases(JobLifecycle& jobs, Log log, std::chrono::milliseconds interval) {
  return repeat("renew_leases", std::move(log), [&jobs, interval] {
    jobs.renew_leases();
    return interval;
  });
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

std::jthread collect_assets(AssetStore& assets, MaintenanceStore& references, Clock clock, const Log& log,
                            CollectorSettings settings) {
  return repeat("collect_assets", log, [&, clock = std::move(clock), log, settings, next = 0]() mutable {
    const int part = std::exchange(next, (next + 1) % AssetStore::parts);
    const int removed = collect_assets(assets, references, part, clock() - settings.age.count());
    if (removed > 0) log(LogLevel::info, "assets_collected", {{"count", std::to_string(removed)}});
    return next == 0 ? settings.round_pause : settings.step_pause;
  });
}

}  // namespace queue
