#include "server/telemetry/service_history.h"

#include <algorithm>
#include <utility>

namespace telemetry {
namespace {

/// The smallest value that at least `percent` % of the sorted values do not exceed (nearest rank).
std::optional<std::int64_t> percentile(const std::vector<std::int64_t>& sorted, std::size_t percent) {
  if (sorted.empty()) return std::nullopt;
  return sorted[(sorted.size() * percent + 99) / 100 - 1];
}

}  // namespace

void ServiceHistory::count_end(bool failed) {
  const std::lock_guard lock(mutex_);
  ++current_.ended;
  if (failed) ++current_.failed;
}

void ServiceHistory::add_wait(std::int64_t wait_ms) {
  const std::lock_guard lock(mutex_);
  waits_ms_.push_back(wait_ms);
}

void ServiceHistory::add_rays(std::uint64_t rays) {
  const std::lock_guard lock(mutex_);
  current_.rays += static_cast<std::int64_t>(rays);
}

void ServiceHistory::close_step(std::int64_t now, std::int64_t queued, std::int64_t running, std::int64_t rss_bytes) {
  const std::lock_guard lock(mutex_);
  Step step = std::exchange(current_, {});
  std::vector<std::int64_t> waits = std::exchange(waits_ms_, {});
  std::sort(waits.begin(), waits.end());
  step.wait_p50_ms = percentile(waits, 50);
  step.wait_p95_ms = percentile(waits, 95);
  step.queued = queued;
  step.running = running;
  step.rss_bytes = rss_bytes;
  closed_.push_back(step);
  if (closed_.size() > steps_max) closed_.pop_front();
  until_ = now;
}

ServiceHistory::Hour ServiceHistory::hour() const {
  const std::lock_guard lock(mutex_);
  return {{closed_.begin(), closed_.end()}, until_};
}

}  // namespace telemetry
