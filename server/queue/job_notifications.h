#pragma once
/// The state of jobs that exists only while this daemon runs, and notifications of changes of jobs to observers, to
/// waiters and to the listener for webhooks.

#include <algorithm>
#include <atomic>
#include <cstdint>
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
#include "server/queue/throughput.h"

namespace queue {

/// Progress, leases and durability of jobs. Thread-safe.
class RunningJobs {
 public:
  /// True if the job follows one that runs with the same content key: it needs no worker, and waits for take_followers.
  /// A job with a deadline does not follow, because only a worker's jobs are stopped in time.
  bool begin(const Claim& claim) {
    const std::lock_guard lock(mutex_);
    const Job& job = claim.job;
    leases_.insert_or_assign(job.id, claim.fence);
    if (job.use_cache && !job.deadline && !job.suspect) {
      const auto leader = leaders_.find(job.content_key);
      if (leader != leaders_.end()) leader->second.followers.push_back({job.id, claim.fence});
      if (leader != leaders_.end()) return true;
    }
    if (!job.content_key.empty()) leaders_.try_emplace(job.content_key, Leader{job.id, {}});
    running_.insert_or_assign(job.id, Running{0.0, job.work, job.created_at, job.started_at.value()});
    return false;
  }
  struct Followers {
    std::string content_key;
    std::vector<Lease> leases;
  };
  /// The jobs that follow this one, which has ended or returns to the queue. Later ones do not follow it.
  Followers take_followers(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto leader = std::ranges::find_if(leaders_, [&](const auto& l) { return l.second.id == id; });
    if (leader == leaders_.end()) return {};
    Followers followers{leader->first, std::move(leader->second.followers)};
    leaders_.erase(leader);
    return followers;
  }
  /// The lease of a job that follows another one, and does not any more.
  std::optional<Lease> stop_following(const std::string& id) {
    const std::lock_guard lock(mutex_);
    std::optional<Lease> lease;
    const auto is_it = [&](const Lease& follower) {
      if (follower.job_id == id) lease = follower;
      return follower.job_id == id;
    };
    for (auto& [key, leader] : leaders_) std::erase_if(leader.followers, is_it);
    return lease;
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
    const auto found = running_.find(id);
    if (found != running_.end()) return found->second.progress;
    const auto elsewhere = elsewhere_.find(id);
    return elsewhere == elsewhere_.end() ? 0 : elsewhere->second;
  }
  void set_progress_elsewhere(const std::string& id, double fraction) {
    const std::lock_guard lock(mutex_);
    if (elsewhere_.size() >= elsewhere_max) elsewhere_.clear();
    elsewhere_.insert_or_assign(id, fraction);
  }
  /// The job has ended, here or on another node.
  void end_elsewhere(const std::string& id) {
    const std::lock_guard lock(mutex_);
    elsewhere_.erase(id);
    not_durable_.erase(id);
  }
  /// The progress afterwards, which never decreases; empty where the job does not run.
  std::optional<double> set_progress(const std::string& id, double fraction) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end()) return std::nullopt;
    double& progress = found->second.progress;
    return progress = std::max(progress, std::clamp(fraction, 0.0, 1.0));
  }
  std::string measurement(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    return found == running_.end() ? std::string() : found->second.measurement;
  }
  void set_measurement(const std::string& id, std::string summary) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    if (found != running_.end()) found->second.measurement = std::move(summary);
  }
  /// The run of a job that ends at `now`; none if it does not run.
  std::optional<EndedJob::Run> run_until(const std::string& id, std::int64_t now) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end()) return std::nullopt;
    const std::int64_t started_at = found->second.started_at;
    return EndedJob::Run{found->second.created_at, started_at, std::max(now, started_at)};
  }
  void clear_progress(const std::string& id) {
    const std::lock_guard lock(mutex_);
    running_.erase(id);
  }
  /// Sum of Job::work that remains.
  double remaining_work() {
    const std::lock_guard lock(mutex_);
    double work = 0;
    for (const auto& [id, job] : running_) work += static_cast<double>(job.work) * (1 - job.progress);
    return work;
  }
  /// Seconds until the last running job ends if all go on as before; 0 while none has made progress.
  double remaining_s(std::int64_t now) {
    const std::lock_guard lock(mutex_);
    double longest = 0;
    for (const auto& [id, job] : running_) {
      const double elapsed = static_cast<double>(now - job.started_at) / 1000;
      if (job.progress >= 0.01) longest = std::max(longest, elapsed * (1 - job.progress) / job.progress);
    }
    return longest;
  }
  /// Adds a running job that succeeds at `now` to the estimate.
  void add_duration(const std::string& id, std::int64_t now, ThroughputEstimate& throughput) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end() || found->second.work == 0 || now <= found->second.started_at) return;
    const double seconds = static_cast<double>(now - found->second.started_at) / 1000;
    throughput.add(seconds, static_cast<double>(found->second.work), running_.size());
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

 private:
  struct Running {
    double progress = 0;
    std::int64_t work = 0, created_at = 0, started_at = 0;
    std::string measurement = {};  ///< results so far
  };
  struct Leader {
    std::string id;
    std::vector<Lease> followers;
  };
  std::mutex mutex_;
  std::unordered_map<std::string, Running> running_;
  std::unordered_map<std::string, Leader> leaders_;       ///< by content key: few, as they have workers
  std::unordered_map<std::string, std::int64_t> leases_;  ///< fence by id
  std::unordered_set<std::string> not_durable_;
  /// Progress of jobs that other nodes run, which comes again within a second.
  std::unordered_map<std::string, double> elsewhere_;
  static constexpr std::size_t elsewhere_max = 10'000;
};

/// Thread-safe, except `observe`.
class JobNotifications {
 public:
  JobNotifications(RunningJobs& running, JobWaiters& waiters) : running_(running), waiters_(waiters) {}

  /// Before jobs are submitted or run; must outlive this. Observers are called in the order of these calls.
  void observe(JobObserver* observer) { observers_.push_back(observer); }
  /// Replaces the listener by another one or null. It must live until no call is in progress any more.
  void set_completion_listener(CompletionListener* listener) { listener_ = listener; }

  /// Called before the job is stored, so that every end is reported.
  void prepare(const Job& job) {
    describe(job);
    CompletionListener* const listener = listener_;
    if (job.webhook && listener != nullptr) listener->register_webhook(job.id, *job.webhook);
  }

  /// Called also after a change of the job.
  void describe(const Job& job) { call_observers(&JobObserver::on_described, summary_of(job)); }

  /// Once for each PendingAnnouncement.
  void notify_queued(const std::string& id) {
    const std::lock_guard lock(mutex_);
    if (pending_.erase(id) > 0) call_observers(&JobObserver::on_state_changed, id, JobState::queued);
  }
  /// Without a PendingAnnouncement, if `is_queued`. Another thread that has changed the job since then notifies later.
  void notify_queued_again(const std::string& id, const std::function<bool()>& is_queued) {
    const std::lock_guard lock(mutex_);  // notify_state of any thread waits for it
    if (is_queued()) call_observers(&JobObserver::on_state_changed, id, JobState::queued);
  }
  void notify_state(const std::string& id, JobState to) {
    notify_queued(id);
    call_observers(&JobObserver::on_state_changed, id, to);
  }
  /// See RunningJobs::begin.
  bool notify_claimed(const Claim& claim) {
    const bool follows = running_.begin(claim);
    waiters_.on_started(claim.job.id);
    notify_state(claim.job.id, JobState::running);
    return follows;
  }
  void notify_end(const EndedJob& job) {
    notify_state(job.id, job.state);
    finish(job.id);
    call_observers(&JobObserver::on_waiters_notified, job);
  }
  void notify_removed(const JobSummary& job) {
    call_observers(&JobObserver::on_removed, job);
    finish(job.id);
  }
  void notify_expired(const char* reason, int jobs) {
    if (jobs > 0) call_observers(&JobObserver::on_expired, reason, jobs);
  }
  void notify_measurement(const std::string& id, const std::string& summary) {
    call_observers(&JobObserver::on_measurement, id, summary);
  }
  /// The job has ended, perhaps on another node; may follow notify_end.
  void on_ended(const std::string& id) {
    running_.end_elsewhere(id);
    waiters_.on_ended(id);
    if (CompletionListener* const listener = listener_) listener->on_ended(id);
  }
  /// The progress of a job that another node runs.
  void on_progress_elsewhere(const std::string& id, double fraction) { running_.set_progress_elsewhere(id, fraction); }
  void notify_progress(const std::string& id, double fraction) {
    call_observers(&JobObserver::on_progress, id, fraction);
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
    PendingAnnouncement(PendingAnnouncement&&) = delete;

   private:
    JobNotifications& notifications_;
    const std::vector<std::string> ids_;
  };

 private:
  template <class... Parameters, class... Arguments>
  void call_observers(void (JobObserver::*call)(Parameters...) noexcept, const Arguments&... arguments) {
    for (JobObserver* const observer : observers_) (observer->*call)(arguments...);
  }
  void finish(const std::string& id) {
    running_.clear_progress(id);
    on_ended(id);
  }

  RunningJobs& running_;
  JobWaiters& waiters_;
  std::vector<JobObserver*> observers_;
  std::atomic<CompletionListener*> listener_ = nullptr;
  std::mutex mutex_;  ///< held while observers are called for `queued`
  std::unordered_set<std::string> pending_;
};

}  // namespace queue
