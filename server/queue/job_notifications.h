#pragma once
/// Notifications of changes of jobs to the observer, to waiters and to the listener for webhooks.

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <unordered_set>
#include <vector>

#include "server/queue/completion_listener.h"
#include "server/queue/job_observer.h"
#include "server/queue/job_waiters.h"
#include "server/queue/running_jobs.h"

namespace queue {

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
