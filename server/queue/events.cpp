#include "server/queue/events.h"

#include <algorithm>
#include <new>
#include <utility>

#include "server/queue/job_store.h"

namespace queue {

void Events::Listener::on_news(std::function<void()> wake) {
  const std::lock_guard lock(events_.mutex_);
  wake_ = std::move(wake);
  if (!untaken_.empty() || over_) wake_();
}

Events::Batch Events::Listener::take(std::size_t bytes) {
  const std::lock_guard lock(events_.mutex_);
  Batch batch;
  while (!untaken_.empty()) {
    const std::string& text = events_.text_of(*untaken_.front());
    if (!batch.text.empty() && batch.text.size() + text.size() > bytes) break;
    batch.text += text;
    untaken_.pop_front();
  }
  batch.over = over_ && untaken_.empty();
  return batch;
}

void Events::Listener::push(const SharedEvent& event) {
  if (over_) return;
  const bool was_empty = untaken_.empty();
  const bool progress = event->event.kind == JobEvent::Kind::progress;
  if (progress && !was_empty && untaken_.back()->event.kind == JobEvent::Kind::progress &&
      untaken_.back()->event.job.id == event->event.job.id) {
    untaken_.back() = event;  // includes the older progress
    return;
  }
  if (untaken_.size() >= untaken_max_) {
    untaken_.clear();
    over_ = true;
  } else {
    untaken_.push_back(event);
    over_ = topic_ == event->event.job.id && event->event.kind == JobEvent::Kind::done;
  }
  if (was_empty && wake_) wake_();
}

Events::Events(Writer write, Clock clock, EventSettings settings, Describe describe)
    : write_(std::move(write)),
      clock_(std::move(clock)),
      settings_(settings),
      describe_(std::move(describe)),
      last_(clock_() * 1000),  // above all numbers of earlier runs, which had fewer than 1000 events a millisecond
      floor_(last_) {}

void Events::cache(const JobSummary& job) {
  const std::lock_guard lock(mutex_);
  if (cached_.size() >= settings_.kept) cached_.clear();
  cached_.insert_or_assign(job.id, CachedJob{job, 0});
}

void Events::on_described(const JobSummary& job) noexcept {
  try {
    cache(job);
  } catch (const std::bad_alloc&) {
    return;  // it is read later
  }
}

JobSummary Events::describe(const std::string& id, JobEvent::Kind kind) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = cached_.find(id);
    if (found != cached_.end()) {
      if (kind == JobEvent::Kind::state) found->second.progress_at = 0;
      return found->second.job;
    }
  }
  JobSummary job{.id = id};
  try {
    if (describe_) job = describe_(id).value_or(job);
  } catch (const StoreFailure&) {
    return job;
  }
  if (kind != JobEvent::Kind::done) cache(job);
  return job;
}

void Events::on_state_changed(const std::string& id, JobState to) noexcept {
  const auto kind = ended(to) ? JobEvent::Kind::done : JobEvent::Kind::state;
  publish({0, kind, describe(id, kind), name_of(to), to == JobState::succeeded ? 1.0 : 0.0, clock_()});
}

void Events::on_removed(const JobSummary& job) noexcept {
  publish({0, JobEvent::Kind::done, job, "removed", 0, clock_()});
}

void Events::on_progress(const std::string& id, double fraction) noexcept {
  const std::int64_t now = clock_();
  constexpr auto kind = JobEvent::Kind::progress;
  if (listeners() == 0) return;
  const JobSummary job = describe(id, kind);
  {
    const std::lock_guard lock(mutex_);
    if (!has_listener("") && !has_listener(id) && !has_listener(job.batch)) return;
    const auto cached = cached_.find(id);
    if (cached != cached_.end() && now - cached->second.progress_at < settings_.progress_interval.count()) return;
  }
  publish({0, kind, job, name_of(JobState::running), fraction, now});
}

void Events::continue_from(std::int64_t number, std::function<void()> catch_up) {
  const std::lock_guard lock(mutex_);
  is_shared_ = true;
  catch_up_ = std::move(catch_up);
  last_ = floor_ = number;
  kept_.clear();
  for (const auto& [topic, listener] : listeners_) {
    listener->over_ = true;
    if (listener->wake_) listener->wake_();
  }
}

void Events::add(JobEvent event) noexcept {
  const std::lock_guard lock(mutex_);
  if (event.number <= last_) return;
  last_ = event.number;
  deliver(std::move(event));
}

void Events::publish(JobEvent event) noexcept {
  const std::lock_guard lock(mutex_);
  event.number = is_shared_ ? last_ : ++last_;
  deliver(std::move(event));
}

/// Within the lock. Without memory the event is lost for all listeners; clients that reconnect find its number missing.
void Events::deliver(JobEvent event) noexcept {
  try {
    const bool progress = event.kind == JobEvent::Kind::progress;
    if (progress) cached_[event.job.id] = {event.job, event.at};
    if (event.kind == JobEvent::Kind::done) cached_.erase(event.job.id);
    const SharedEvent shared = std::make_shared<Written>(Written{std::move(event)});
    if (!progress) kept_.push_back(shared);
    if (kept_.size() > settings_.kept) {
      floor_ = kept_.front()->event.number;
      kept_.pop_front();
    }
    const JobSummary& job = shared->event.job;
    for (const std::string& topic : std::set<std::string>{"", job.id, job.batch})
      for (auto entry = listeners_.lower_bound({topic, nullptr}); entry != listeners_.end() && entry->first == topic;
           ++entry)
        if (entry->second->is_for(job)) entry->second->push(shared);
  } catch (const std::bad_alloc&) {
    floor_ = last_;
    kept_.clear();
  }
}

/// Precondition: mutex_ is held.
const std::string& Events::text_of(Written& event) const {
  if (event.text.empty()) event.text = write_(event.event);
  return event.text;
}

std::unique_ptr<Events::Listener> Events::listen(const std::string& topic, std::optional<std::int64_t> after) {
  std::unique_lock lock(mutex_);
  if (const auto catch_up = catch_up_; catch_up && after && *after > last_) {
    lock.unlock();
    catch_up();
    lock.lock();
  }
  if (listeners_.size() >= settings_.listeners_max) return nullptr;
  const bool complete = after && *after >= floor_ && *after <= last_;
  auto listener = std::make_unique<Listener>(*this, topic, complete ? *after : last_, after && !complete);
  listeners_.emplace(topic, listener.get());
  if (!complete) return listener;
  const auto first = std::ranges::upper_bound(kept_, *after, {}, [](const auto& kept) { return kept->event.number; });
  for (auto event = first; event != kept_.end(); ++event) {
    if (!listener->is_for((*event)->event.job)) continue;
    ++listener->untaken_max_;  // missed events do not count as slowness
    listener->push(*event);
  }
  return listener;
}

void Events::remove(Listener& listener) {
  const std::lock_guard lock(mutex_);
  listeners_.erase({listener.topic_, &listener});
}

/// Precondition: mutex_ is held.
bool Events::has_listener(const std::string& topic) const {
  const auto next = listeners_.lower_bound({topic, nullptr});
  return next != listeners_.end() && next->first == topic;
}

bool Events::ended_by(const std::string& job_id, std::int64_t number) const {
  const std::lock_guard lock(mutex_);
  if (number > last_) return false;
  return std::ranges::any_of(kept_, [&](const auto& kept) {
    return kept->event.number <= number && kept->event.kind == JobEvent::Kind::done && kept->event.job.id == job_id;
  });
}

std::int64_t Events::latest() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

std::size_t Events::listeners() const {
  const std::lock_guard lock(mutex_);
  return listeners_.size();
}

}  // namespace queue
