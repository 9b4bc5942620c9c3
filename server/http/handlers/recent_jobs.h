#pragma once
/// Jobs whose images were read lately, so that they can be read while the database is away.

#include <cstddef>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/queue/job.h"

namespace http::handlers {

/// Without their reports. The first ones are dropped beyond `jobs_max`. Thread-safe.
class RecentJobs {
 public:
  static constexpr std::size_t jobs_max = 10'000;  ///< about 10 MB

  /// No effect unless the job has succeeded: its images then change only by expiry or removal.
  void add(const queue::Job& job) {
    if (job.state != queue::JobState::succeeded) return;
    const std::lock_guard lock(mutex_);
    const auto [found, is_new] = jobs_.insert_or_assign(job.id, job);
    found->second.report.clear();
    if (is_new) order_.push_back(job.id);
    if (order_.size() <= jobs_max) return;
    jobs_.erase(order_.front());
    order_.pop_front();
  }
  std::optional<queue::Job> find(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    return found == jobs_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::string, queue::Job> jobs_;
  std::list<std::string> order_;  ///< oldest first
};

}  // namespace http::handlers
