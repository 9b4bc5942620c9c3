#pragma once
/// The state of jobs that exists only while this daemon runs, and notifications of changes of jobs to the observer, to
/// waiters and to the listener for webhooks.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "server/queue/job_observer.h"
#include "server/queue/job_store.h"
#include "server/queue/job_waiters.h"

namespace queue {

/// Progress, leases, durability and recent ends of jobs. Thread-safe.
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

/// Thread-safe, except `observe`.
class JobNotifications {
 public:
  JobNotifications(RunningJobs& running, JobWaiters& waiters) : running_(running), waiters_(waiters) {}

  /// Once, before jobs are submitted or run; must outlive this.
  void observe(JobObserver* observer) { observer_ = observer; }
  /// Replaces the listener by another one or null. It must live until no call is in progress any more.
  void set_completion_listener(CompletionListener* listener) { listener_ = listener; }

  /// Called before the job is stored, so that every end is reported.
  void register_webhook(const Job& job);

  void notify_queued(const std::string& id);  ///< once for each PendingAnnouncement
  /// Without a PendingAnnouncement, if `is_queued`. Another thread that has changed the job since then notifies later.
  void notify_queued_again(const std::string& id, const std::function<bool()>& is_queued);
  void notify_state(const std::string& id, JobState to);
  void notify_claimed(const Claim& claim);
  void notify_end(const std::string& id, JobState state);
  void notify_removed(const std::string& id);
  void notify_progress(const std::string& id, double fraction);

  /// Jobs that are about to be queued. The first thread that has stored or claimed one notifies the observer, so that
  /// `running` never precedes `queued`.
  class PendingAnnouncement {
   public:
    PendingAnnouncement(JobNotifications& notifications, std::vector<std::string> ids);
    ~PendingAnnouncement();
    PendingAnnouncement(const PendingAnnouncement&) = delete;
    PendingAnnouncement& operator=(const PendingAnnouncement&) = delete;

   private:
    JobNotifications& notifications_;
    const std::vector<std::string> ids_;
  };

 private:
  void finish(const std::string& id);

  RunningJobs& running_;
  JobWaiters& waiters_;
  JobObserver* observer_ = nullptr;
  std::atomic<CompletionListener*> listener_ = nullptr;
  std::mutex mutex_;  ///< held while the observer is called for `queued`
  std::unordered_set<std::string> pending_;
};

}  // namespace queue
