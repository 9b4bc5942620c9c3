#include "server/queue/queue.h"

#include <algorithm>
#include <utility>

#include "server/queue/pending_announcement.h"

namespace queue {
namespace {

constexpr std::int64_t position_max = 1000;  // counting is a walk; who is further back looks again later
constexpr std::size_t recent_ends_max = 64;

}  // namespace

Queue::Queue(JobStore& store, ArtifactStore& artifacts, IdSource& ids, Clock clock, const Log& log,
             QueueSettings settings)
    : store_(store),
      ids_(ids),
      clock_(std::move(clock)),
      settings_(settings),
      boot_id_(ids.next()),
      pins_(store, artifacts, settings.small_image_bytes, log),
      previews_(clock_) {
  const int recovered = store_.recover(boot_id_, clock_());
  for (const std::string& batch : store_.failing_batches()) cancel_batch(batch);
  if (recovered > 0) log(LogLevel::info, "jobs_recovered", {{"count", std::to_string(recovered)}});
}

// ---- for the HTTP room

void Queue::wake_runner(bool for_suspects) {
  const std::shared_lock lock(runner_mutex_);
  if (runner_ != nullptr) runner_->wake(for_suspects);
}

JobView Queue::view(Job job) {
  const double fraction = job.state == JobState::succeeded ? 1 : progress(job.id);
  std::optional<std::int64_t> position;
  if (job.state == JobState::queued) {
    const std::optional<std::int64_t> before = store_.queue_position(job.id, position_max);
    if (before && *before < position_max) position = *before + 1;
  }
  return {std::move(job), fraction, position};
}

std::optional<JobView> Queue::find(const std::string& id) {
  std::optional<Job> job = store_.find(id);
  if (!job) return std::nullopt;
  return view(*std::move(job));
}

JobPage Queue::list(const JobFilter& filter, const std::string& cursor, int limit) {
  return store_.list(filter, cursor, std::max(limit, 1));
}

double Queue::progress(const std::string& id) {
  const std::lock_guard lock(live_mutex_);
  const auto found = progress_.find(id);
  return found == progress_.end() ? 0 : found->second;
}

CancelOutcome Queue::cancel(const std::string& id) {
  const CancelOutcome outcome = store_.cancel(id, clock_());
  if (outcome == CancelOutcome::cancelled) {
    tell_end(id, JobState::cancelled);
  }
  if (outcome == CancelOutcome::cancelling) {
    const std::shared_lock lock(runner_mutex_);
    if (runner_ != nullptr) runner_->cancel(id);
  }
  return outcome;
}

RemoveOutcome Queue::remove(const std::string& id) {
  const Removal removal = store_.remove(id);
  if (removal.outcome == RemoveOutcome::removed) {
    if (observer_ != nullptr) observer_->removed(id);
    job_ended(id);
    for (const Artifact& artifact : removal.artifacts) pins_.collect(artifact.sha256);
  }
  return removal.outcome;
}

bool Queue::is_durable(const std::string& id) {
  const std::lock_guard lock(live_mutex_);
  return !not_durable_.contains(id);
}

void Queue::make_durable(const std::string& id) {
  if (is_durable(id)) return;
  store_.probe();  // a durable write brings all before it along
  const std::lock_guard lock(live_mutex_);
  not_durable_.erase(id);
}

std::unique_ptr<ArtifactReader> Queue::open(const Artifact& artifact) { return pins_.open(artifact.sha256); }

std::uint64_t Queue::when_ended(const std::string& id, std::function<void()> done) {
  std::uint64_t token = 0;
  {
    const std::lock_guard lock(live_mutex_);
    token = ++last_token_;
    waiters_.emplace(token, Waiter{id, std::move(done)});
    waiting_for_.emplace(id, token);
  }
  // Looked up after the waiter is in place: an end in between is told by one of the two, and only once.
  try {
    const std::optional<Job> job = store_.find(id);
    if (!job || ended(job->state)) job_ended(id);
  } catch (...) {
    forget(token);
    throw;
  }
  return token;
}

void Queue::forget(std::uint64_t token) {
  const std::lock_guard lock(live_mutex_);
  const auto waiter = waiters_.find(token);
  if (waiter == waiters_.end()) return;
  const auto [first, last] = waiting_for_.equal_range(waiter->second.id);
  waiting_for_.erase(std::find_if(first, last, [&](const auto& entry) { return entry.second == token; }));
  waiters_.erase(waiter);
}

void Queue::tell(const std::string& id, JobState to) {
  notify_queued(id);
  if (observer_ != nullptr) observer_->on_state_changed(id, to);
}

void Queue::tell_end(const std::string& id, JobState state) {
  tell(id, state);
  job_ended(id);
  if (observer_ != nullptr) observer_->on_waiters_notified(id);
}

void Queue::notify_queued(const std::string& id) {
  const std::lock_guard lock(arrivals_mutex_);
  if (arrivals_.erase(id) > 0 && observer_ != nullptr) observer_->on_state_changed(id, JobState::queued);
}

void Queue::job_ended(const std::string& id) {
  std::vector<std::function<void()>> calls;
  {
    const std::lock_guard lock(live_mutex_);
    progress_.erase(id);
    not_durable_.erase(id);
    const auto [first, last] = waiting_for_.equal_range(id);
    for (auto entry = first; entry != last; ++entry) {
      calls.push_back(std::move(waiters_.extract(entry->second).mapped().done));
    }
    waiting_for_.erase(first, last);
  }
  for (const auto& call : calls) call();
  for (const auto& call : previews_.ended(id)) call();
  if (CompletionListener* const listener = listener_) listener->ended(id);
}

std::string Queue::not_ready() {
  if (const DiskSpace room = room_ ? room_() : DiskSpace{}; room.state != DiskSpace::State::enough)
    return "disk: " + describe(room);
  try {
    store_.probe();
  } catch (const StoreFailure& failure) {
    return std::string("store: ") + failure.what();
  }
  const std::shared_lock lock(runner_mutex_);
  return runner_ == nullptr ? "worker: not started" : runner_->not_ready();
}

// ---- for whoever runs jobs

void Queue::attach(JobRunner* runner) {
  const std::lock_guard lock(runner_mutex_);
  runner_ = runner;
}

bool Queue::has_no_room() const { return room_ && room_().state == DiskSpace::State::none; }

std::optional<Claim> Queue::claim(bool alone) {
  if (has_no_room()) return std::nullopt;
  const std::int64_t now = clock_();
  return began(store_.claim(boot_id_, now, now + settings_.lease_ms, alone));
}

std::optional<Claim> Queue::claim_small() {
  if (has_no_room()) return std::nullopt;
  const std::int64_t now = clock_();
  return began(store_.claim_small(boot_id_, now, now + settings_.lease_ms));
}

std::optional<Claim> Queue::began(std::optional<Claim> claim) {
  if (claim) {
    const std::lock_guard lock(live_mutex_);
    progress_.insert_or_assign(claim->job.id, 0.0);
    leases_.insert_or_assign(claim->job.id, claim->fence);
  }
  if (claim) tell(claim->job.id, JobState::running);
  return claim;
}

/// The store has answered what became of the claim: either way it is over.
void Queue::let_go(const std::string& id, std::int64_t fence) {
  const std::lock_guard lock(live_mutex_);
  const auto found = leases_.find(id);
  if (found != leases_.end() && found->second == fence) leases_.erase(found);
}

void Queue::renew_leases() {
  std::vector<Lease> held;
  {
    const std::lock_guard lock(live_mutex_);
    for (const auto& [id, fence] : leases_) held.push_back({id, fence});
  }
  if (held.empty()) return;
  for (const Lease& lost : store_.renew(held, clock_() + settings_.lease_ms)) {
    let_go(lost.job_id, lost.fence);
    const std::shared_lock lock(runner_mutex_);
    if (runner_ != nullptr) runner_->lost(lost);
  }
}

bool Queue::fail(const std::string& id, std::int64_t fence, const Problem& problem) {
  const bool on_state_changed = store_.fail(id, fence, clock_(), problem);
  let_go(id, fence);
  if (!on_state_changed) return false;
  note_end();
  tell_end(id, JobState::failed);
  stop_where_too_many_failed(id);
  return true;
}

bool Queue::finish_cancel(const std::string& id, std::int64_t fence) {
  const bool on_state_changed = store_.finish_cancel(id, fence, clock_());
  let_go(id, fence);
  if (on_state_changed) tell_end(id, JobState::cancelled);
  return on_state_changed;
}

void Queue::note_end() {
  const std::lock_guard lock(live_mutex_);
  recent_ends_.push_back(clock_());
  if (recent_ends_.size() > recent_ends_max) recent_ends_.pop_front();
}

bool Queue::release(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::int64_t pause_ms) {
  {
    const std::lock_guard lock(live_mutex_);
    progress_.erase(id);  // a waiting job has none; its next claim starts at 0
  }
  for (const auto& call : previews_.ended(id)) call();
  const std::int64_t now = clock_();
  Release how{counts, suspect};
  if (pause_ms > 0) how.not_before = now + pause_ms;
  std::optional<PendingAnnouncement> arrival(std::in_place, *this, std::vector{id});
  const bool on_state_changed = store_.release(id, fence, now, how);
  let_go(id, fence);
  if (on_state_changed) notify_given_back(id, arrival);
  return on_state_changed;
}

/// It waits again, or a cancel that was asked for has ended it.
void Queue::notify_given_back(const std::string& id, std::optional<PendingAnnouncement>& arrival) {
  const std::optional<Job> job = store_.find(id);
  if (job && !ended(job->state)) return notify_queued(id);
  arrival.reset();
  if (job) return tell_end(id, job->state);
  job_ended(id);
}

bool Queue::succeed(const std::string& id, std::int64_t fence, const std::string& report,
                    const std::vector<Image>& images) {
  ArtifactPins::Pinned pinned(pins_);
  std::vector<Artifact> artifacts;
  std::vector<SmallImage> small;
  for (const Image& image : images) {
    ArtifactStore::Stored stored = pinned.put(image.fd);
    artifacts.push_back({image.name, image.media_type, stored.sha256, stored.bytes});
    if (stored.small) small.push_back({stored.sha256, *std::move(stored.small)});
  }
  const bool on_state_changed = store_.succeed(id, fence, clock_(), report, artifacts, is_durable(id), small);
  let_go(id, fence);
  if (on_state_changed) note_end();
  if (on_state_changed) tell_end(id, JobState::succeeded);
  return on_state_changed;
}

std::uint64_t Queue::look(const std::string& id, std::uint32_t side, std::function<void()> done) {
  const Previews::Wish wish = previews_.wish(id, side, std::move(done));
  const std::shared_lock lock(runner_mutex_);
  if (wish.is_new && runner_ != nullptr) runner_->look(id, side);
  return wish.token;
}

void Queue::previewed(const std::string& id, std::uint32_t side, std::string png) {
  Previews::Calls calls;
  {
    const std::lock_guard lock(live_mutex_);
    if (!progress_.contains(id)) return;  // the job has ended meanwhile
    calls = previews_.came(id, side, std::move(png));
  }
  for (const auto& call : calls) call();
}

void Queue::progressed(const std::string& id, double fraction) {
  {
    const std::lock_guard lock(live_mutex_);
    const auto found = progress_.find(id);
    if (found == progress_.end()) return;  // the job has ended meanwhile
    fraction = found->second = std::max(found->second, std::clamp(fraction, 0.0, 1.0));
  }
  if (observer_ != nullptr) observer_->progressed(id, fraction);
}

}  // namespace queue
