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
#include <utility>
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
  void register_webhook(const Job& job) {
    CompletionListener* const listener = listener_;
    if (job.webhook && listener != nullptr) listener->register_webhook(job.id, *job.webhook);
  }

  /// Once for each PendingAnnouncement.
  void notify_queued(const std::string& id) {
    const std::lock_guard lock(mutex_);
    if (pending_.erase(id) > 0 && observer_ != nullptr) observer_->on_state_changed(id, JobState::queued);
  }
  /// Without a PendingAnnouncement, if `is_queued`. Another thread that has changed the job since then notifies later.
  void notify_queued_again(const std::string& id, const std::function<bool()>& is_queued) {
    const std::lock_guard lock(mutex_);  // notify_state of any thread waits for it
    if (is_queued() && observer_ != nullptr) observer_->on_state_changed(id, JobState::queued);
  }
  void notify_state(const std::string& id, JobState to) {
    notify_queued(id);
    if (observer_ != nullptr) observer_->on_state_changed(id, to);
  }
  void notify_claimed(const Claim& claim) {
    running_.begin(claim.job.id, claim.fence);
    waiters_.on_started(claim.job.id);
    notify_state(claim.job.id, JobState::running);
  }
  void notify_end(const std::string& id, JobState state) {
    notify_state(id, state);
    finish(id);
    if (observer_ != nullptr) observer_->on_waiters_notified(id);
  }
  void notify_removed(const std::string& id) {
    if (observer_ != nullptr) observer_->on_removed(id);
    finish(id);
  }
  void notify_progress(const std::string& id, double fraction) {
    if (observer_ != nullptr) observer_->on_progress(id, fraction);
  }

  /// Jobs that are about to be queued. The first thread that has stored or claimed one notifies the observer, so that
  /// `running` never precedes `queued`.
  class PendingAnnouncement {
   public:
    PendingAnnouncement(JobNotifications& notifications, std::vector<std::string> ids)
        : notifications_(notifications), ids_(std::move(ids)) {
      const std::lock_guard lock(notifications_.mutex_);
      notifications_.pending_.insert(ids_.begin(), ids_.end());
    }
    ~PendingAnnouncement() {
      const std::lock_guard lock(notifications_.mutex_);
      for (const std::string& id : ids_) notifications_.pending_.erase(id);
    }
    PendingAnnouncement(const PendingAnnouncement&) = delete;
    PendingAnnouncement& operator=(const PendingAnnouncement&) = delete;

   private:
    JobNotifications& notifications_;
    const std::vector<std::string> ids_;
  };

 private:
  void finish(const std::string& id) {
    running_.erase(id);
    waiters_.on_ended(id);
    if (CompletionListener* const listener = listener_) listener->on_ended(id);
  }

  RunningJobs& running_;
  JobWaiters& waiters_;
  JobObserver* observer_ = nullptr;
  std::atomic<CompletionListener*> listener_ = nullptr;
  std::mutex mutex_;  ///< held while the observer is called for `queued`
  std::unordered_set<std::string> pending_;
};

}  // namespace queue
