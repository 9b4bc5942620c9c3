#pragma once
/// Facts about jobs that exist only while this daemon runs: progress, leases, durability, recent ends.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "server/queue/job_store.h"

namespace queue {

/// Thread-safe.
class RunningJobs {
 public:
  void begin(const std::string& id, std::int64_t fence) {
    const std::lock_guard lock(mutex_);
    progress_.insert_or_assign(id, 0.0);
    leases_.insert_or_assign(id, fence);
  }
  void end_lease(const std::string& id, std::int64_t fence) {
    const std::lock_guard lock(mutex_);
    const auto found = leases_.find(id);
    if (found != leases_.end() && found->second == fence) leases_.erase(found);
  }
  std::vector<Lease> leases() {
    const std::lock_guard lock(mutex_);
    std::vector<Lease> held;
    for (const auto& [id, fence] : leases_) held.push_back({id, fence});
    return held;
  }

  double progress(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto found = progress_.find(id);
    return found == progress_.end() ? 0 : found->second;
  }
  /// The progress afterwards, which never decreases; empty where the job does not run.
  std::optional<double> set_progress(const std::string& id, double fraction) {
    const std::lock_guard lock(mutex_);
    const auto found = progress_.find(id);
    if (found == progress_.end()) return std::nullopt;
    return found->second = std::max(found->second, std::clamp(fraction, 0.0, 1.0));
  }
  void clear_progress(const std::string& id) {
    const std::lock_guard lock(mutex_);
    progress_.erase(id);
  }

  /// True if the rows and images of a job that has not ended must be synced before a call returns.
  bool is_durable(const std::string& id) {
    const std::lock_guard lock(mutex_);
    return !not_durable_.contains(id);
  }
  void set_durable(const std::string& id, bool durable) {
    const std::lock_guard lock(mutex_);
    if (durable) not_durable_.erase(id);
    if (!durable) not_durable_.insert(id);
  }

  void erase(const std::string& id) {
    const std::lock_guard lock(mutex_);
    progress_.erase(id);
    not_durable_.erase(id);
  }

  void add_end(std::int64_t now) {
    const std::lock_guard lock(mutex_);
    recent_ends_.push_back(now);
    if (recent_ends_.size() > 64) recent_ends_.pop_front();
  }
  /// Mean time between the latest ends of jobs; empty until two have ended.
  std::optional<double> mean_interval_ms() {
    const std::lock_guard lock(mutex_);
    if (recent_ends_.size() < 2) return std::nullopt;
    return static_cast<double>(recent_ends_.back() - recent_ends_.front()) /
           static_cast<double>(recent_ends_.size() - 1);
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::string, double> progress_;
  std::unordered_map<std::string, std::int64_t> leases_;  ///< fence by id
  std::unordered_set<std::string> not_durable_;
  std::deque<std::int64_t> recent_ends_;
};

}  // namespace queue
