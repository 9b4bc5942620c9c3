#include "server/queue/job_notifications.h"

#include <utility>

namespace queue {

void JobNotifications::register_webhook(const Job& job) {
  CompletionListener* const listener = listener_;
  if (job.webhook && listener != nullptr) listener->register_webhook(job.id, *job.webhook);
}

void JobNotifications::notify_queued(const std::string& id) {
  const std::lock_guard lock(mutex_);
  if (pending_.erase(id) > 0 && observer_ != nullptr) observer_->on_state_changed(id, JobState::queued);
}

void JobNotifications::notify_queued_again(const std::string& id, const std::function<bool()>& is_queued) {
  const std::lock_guard lock(mutex_);  // notify_state of any thread waits for it
  if (is_queued() && observer_ != nullptr) observer_->on_state_changed(id, JobState::queued);
}

void JobNotifications::notify_state(const std::string& id, JobState to) {
  notify_queued(id);
  if (observer_ != nullptr) observer_->on_state_changed(id, to);
}

void JobNotifications::notify_claimed(const Claim& claim) {
  running_.begin(claim.job.id, claim.fence);
  waiters_.on_started(claim.job.id);
  notify_state(claim.job.id, JobState::running);
}

void JobNotifications::notify_end(const std::string& id, JobState state) {
  notify_state(id, state);
  finish(id);
  if (observer_ != nullptr) observer_->on_waiters_notified(id);
}

void JobNotifications::notify_removed(const std::string& id) {
  if (observer_ != nullptr) observer_->on_removed(id);
  finish(id);
}

void JobNotifications::notify_progress(const std::string& id, double fraction) {
  if (observer_ != nullptr) observer_->on_progress(id, fraction);
}

void JobNotifications::finish(const std::string& id) {
  running_.erase(id);
  waiters_.on_ended(id);
  if (CompletionListener* const listener = listener_) listener->on_ended(id);
}

JobNotifications::PendingAnnouncement::PendingAnnouncement(JobNotifications& notifications,
                                                           std::vector<std::string> ids)
    : notifications_(notifications), ids_(std::move(ids)) {
  const std::lock_guard lock(notifications_.mutex_);
  notifications_.pending_.insert(ids_.begin(), ids_.end());
}

JobNotifications::PendingAnnouncement::~PendingAnnouncement() {
  const std::lock_guard lock(notifications_.mutex_);
  for (const std::string& id : ids_) notifications_.pending_.erase(id);
}

}  // namespace queue
