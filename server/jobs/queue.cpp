#include "server/jobs/queue.h"

#include <algorithm>
#include <utility>

namespace jobs {
namespace {

std::vector<std::string> uploads_of(const tracer::Scene& scene) {
  std::vector<std::string> hashes;
  for (const tracer::Asset& asset : scene.assets) {
    if (asset.name.starts_with(api::upload_prefix)) hashes.push_back(asset.name.substr(api::upload_prefix.size()));
  }
  return hashes;
}

constexpr std::int64_t position_max = 1000;  // counting is a walk; who is further back looks again later
constexpr int upkeep_step = 100;             // jobs of each kind: some milliseconds of the one writer
constexpr std::size_t recent_ends_max = 64;

/// Whether an earlier request under the same key was the same.
tracer::Result<Submitted, Refused> replay(const KeptReply& kept, const Idempotency& idempotency) {
  if (kept.request_sha256 != idempotency.request_sha256) return Refused{Refused::Why::key_reused, 0, 0};
  return Submitted{{}, false, kept.reply};
}

}  // namespace

Queue::Queue(JobStore& store, ArtifactStore& artifacts, IdSource& ids, Clock clock, const Log& log,
             QueueSettings settings)
    : store_(store),
      ids_(ids),
      clock_(std::move(clock)),
      settings_(settings),
      boot_id_(ids.next()),
      artifacts_(artifacts),
      pins_(store, artifacts, log) {
  const int recovered = store_.recover(boot_id_, clock_());
  if (recovered > 0) log(LogLevel::info, "jobs_recovered", {{"count", std::to_string(recovered)}});
}

// ---- for the HTTP room
// -----------------------------------------------------------------------------------------------

std::optional<Refused> Queue::admit_one(const std::string& owner) {
  const std::lock_guard lock(submit_mutex_);
  std::int64_t submitting = 0;
  for (const auto& [name, count] : submitting_) submitting += count;
  const std::int64_t queued = store_.count(JobState::queued) + submitting;
  if (queued >= settings_.queued_limit) return Refused{Refused::Why::queue_full, queued, settings_.queued_limit};
  const OwnerUse use = store_.use_of(owner);
  const auto of_owner = submitting_.find(owner);
  const std::int64_t owners = use.queued_jobs + (of_owner == submitting_.end() ? 0 : of_owner->second);
  if (owners >= settings_.owner_queued_limit) {
    return Refused{Refused::Why::owner_queued_jobs, owners, settings_.owner_queued_limit};
  }
  if (use.artifact_bytes >= settings_.owner_artifact_bytes_limit) {
    return Refused{Refused::Why::owner_artifact_bytes, use.artifact_bytes, settings_.owner_artifact_bytes_limit};
  }
  ++submitting_[owner];
  return std::nullopt;
}

void Queue::leave(const std::string& owner) {
  const std::lock_guard lock(submit_mutex_);
  const auto found = submitting_.find(owner);
  if (--found->second == 0) submitting_.erase(found);
}

Job Queue::job_of(const Submission& submission) {
  const api::JobRequest& asked = submission.parsed.job;
  Job job;
  job.id = ids_.next();
  job.owner = submission.owner;
  job.name = asked.name;
  job.created_at = clock_();
  job.max_attempts = asked.max_attempts;
  job.priority = asked.priority;
  job.run_after = asked.run_after;
  if (asked.run_after && *asked.run_after > job.created_at) job.not_before = asked.run_after;
  job.deadline = asked.deadline;
  job.expires_in_s = asked.expires_in_s;
  job.webhook = asked.webhook;
  job.labels = asked.labels;
  job.width = submission.parsed.scene.image.window().width();
  job.height = submission.parsed.scene.image.window().height();
  job.assets = uploads_of(submission.parsed.scene);
  if (asked.cache != api::CacheUse::off) job.content_key = submission.content_key;
  return job;
}

/// Ends a job that is not stored yet with the pictures of an equal one, if those are there to stay.
bool Queue::finish_from_cache(Job& job, ArtifactPins::Pinned& pinned) {
  const std::optional<Job> equal = store_.finished_as(job.content_key, job.created_at);
  if (!equal || equal->artifacts.empty()) return false;
  for (const Artifact& artifact : equal->artifacts) {
    if (!pinned.hold(artifact.sha256)) return false;
  }
  job.started_at = job.created_at;
  job.state = JobState::running;
  end(job, JobState::succeeded, job.created_at);
  job.report = equal->report;
  job.artifacts = equal->artifacts;
  return true;
}

tracer::Result<Submitted, Refused> Queue::submit(Submission submission) {
  const std::optional<Idempotency>& idempotency = submission.idempotency;
  ReplyKey key;
  if (idempotency) {
    key = {submission.owner, idempotency->route, idempotency->key};
    if (const auto kept = store_.reply(key, clock_())) return replay(*kept, *idempotency);
  }
  // What is admitted counts at once, so that many threads together cannot pass the bounds.
  if (const auto refused = admit_one(submission.owner)) return *refused;
  struct Admitted {
    Queue& queue;
    const std::string& owner;
    ~Admitted() { queue.leave(owner); }
  } const admitted{*this, submission.owner};

  Admission admission;
  NewJob& fresh = admission.jobs.emplace_back(job_of(submission), std::move(submission.document));
  ArtifactPins::Pinned pinned(pins_);
  const bool may_use = submission.parsed.job.cache == api::CacheUse::use && !fresh.job.content_key.empty();
  const bool from_cache = may_use && finish_from_cache(fresh.job, pinned);
  JobView made{fresh.job, from_cache ? 1.0 : 0.0};
  if (idempotency) {
    admission.reply = KeptReply{key, idempotency->request_sha256, submission.write_reply(made, from_cache),
                                made.job.created_at + settings_.reply_kept_ms};
  }
  if (const auto earlier = store_.admit(admission, made.job.created_at)) return replay(*earlier, *idempotency);
  tell(made.job.id, made.job.state);
  if (!from_cache) wake_runner();
  return Submitted{std::move(made), from_cache, std::nullopt};
}

void Queue::wake_runner(bool for_suspects) {
  const std::lock_guard lock(runner_mutex_);
  if (runner_ != nullptr) runner_->wake(for_suspects);
}

JobView Queue::view(Job job) {
  const double fraction = job.state == JobState::succeeded ? 1 : progress(job.id);
  std::optional<std::int64_t> position;
  if (job.state == JobState::queued) {
    const std::optional<std::int64_t> before = store_.waiting_before(job.id, position_max);
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
    tell(id, JobState::cancelled);
    job_ended(id);
  }
  if (outcome == CancelOutcome::cancelling) {
    const std::lock_guard lock(runner_mutex_);
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

RetryOutcome Queue::retry(const std::string& id) {
  const RetryOutcome outcome = store_.retry(id, clock_());
  if (outcome == RetryOutcome::queued) {
    tell(id, JobState::queued);
    wake_runner(true);
  }
  return outcome;
}

ChangeOutcome Queue::change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision) {
  const ChangeOutcome outcome = store_.change(id, change, revision);
  if (outcome == ChangeOutcome::changed && observer_ != nullptr) {
    const std::optional<Job> job = store_.find(id);
    if (job && !ended(job->state)) tell(id, job->state);  // no move, but news to who waits for any
  }
  return outcome;
}

QueueState Queue::state() {
  const std::int64_t now = clock_();
  QueueState state;
  state.depth = store_.depth();
  for (const JobState which : all_job_states) state.jobs[which] = store_.count(which);
  if (state.depth.oldest_at) {
    state.oldest_age_s = static_cast<double>(std::max<std::int64_t>(now - *state.depth.oldest_at, 0)) / 1000;
  }
  const std::lock_guard lock(live_mutex_);
  if (recent_ends_.size() >= 2) {
    const auto elapsed_ms = static_cast<double>(recent_ends_.back() - recent_ends_.front());
    const double each_ms = elapsed_ms / static_cast<double>(recent_ends_.size() - 1);
    const std::int64_t to_do = state.jobs[JobState::queued] - state.depth.delayed + state.jobs[JobState::running];
    state.eta_s = each_ms * static_cast<double>(to_do) / 1000;
  }
  return state;
}

std::unique_ptr<ArtifactReader> Queue::open(const Artifact& artifact) { return artifacts_.open(artifact.sha256); }

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
  if (observer_ != nullptr) observer_->moved(id, to);
}

void Queue::job_ended(const std::string& id) {
  std::vector<std::function<void()>> calls;
  {
    const std::lock_guard lock(live_mutex_);
    progress_.erase(id);
    const auto [first, last] = waiting_for_.equal_range(id);
    for (auto entry = first; entry != last; ++entry) {
      calls.push_back(std::move(waiters_.extract(entry->second).mapped().done));
    }
    waiting_for_.erase(first, last);
  }
  for (const auto& call : calls) call();
}

std::string Queue::not_ready() {
  try {
    store_.probe();
  } catch (const StoreFailure& failure) {
    return std::string("store: ") + failure.what();
  }
  const std::lock_guard lock(runner_mutex_);
  return runner_ == nullptr ? "worker: not started" : runner_->not_ready();
}

// ---- for whoever runs jobs
// -------------------------------------------------------------------------------------------

void Queue::attach(Runner* runner) {
  const std::lock_guard lock(runner_mutex_);
  runner_ = runner;
}

std::optional<Claim> Queue::claim(bool alone) {
  std::optional<Claim> claim = store_.claim(boot_id_, clock_(), alone);
  if (claim) {
    const std::lock_guard lock(live_mutex_);
    progress_.insert_or_assign(claim->job.id, 0.0);
  }
  if (claim) tell(claim->job.id, JobState::running);
  return claim;
}

bool Queue::fail(const std::string& id, std::int64_t fence, const Problem& problem) {
  const bool moved = store_.fail(id, fence, clock_(), problem);
  if (moved) note_end();
  if (moved) tell(id, JobState::failed);
  if (moved) job_ended(id);
  return moved;
}

bool Queue::finish_cancel(const std::string& id, std::int64_t fence) {
  const bool moved = store_.finish_cancel(id, fence, clock_());
  if (moved) tell(id, JobState::cancelled);
  if (moved) job_ended(id);
  return moved;
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
  const std::int64_t now = clock_();
  Release how{counts, suspect};
  if (pause_ms > 0) how.not_before = now + pause_ms;
  const bool moved = store_.release(id, fence, now, how);
  if (!moved) return false;
  const std::optional<Job> job = store_.find(id);  // a requested cancel ended it
  if (job) tell(id, job->state);
  if (!job || ended(job->state)) job_ended(id);
  return true;
}

bool Queue::succeed(const std::string& id, std::int64_t fence, const std::string& report,
                    const std::vector<Picture>& pictures) {
  ArtifactPins::Pinned pinned(pins_);
  std::vector<Artifact> artifacts;
  for (const Picture& picture : pictures) {
    const ArtifactStore::Stored stored = pinned.put(picture.fd);
    artifacts.push_back({picture.name, picture.media_type, stored.sha256, stored.bytes});
  }
  const bool moved = store_.succeed(id, fence, clock_(), report, artifacts);
  if (moved) note_end();
  if (moved) tell(id, JobState::succeeded);
  if (moved) job_ended(id);
  return moved;
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

// ---- for whoever keeps house
// -----------------------------------------------------------------------------------------

bool Queue::keep_house() {
  const Upkeep upkeep = store_.keep_house(clock_(), settings_.expired_kept_ms, upkeep_step);
  for (const std::string& id : upkeep.overdue) {
    tell(id, JobState::failed);
    job_ended(id);
  }
  for (const Artifact& artifact : upkeep.artifacts) pins_.collect(artifact.sha256);
  if (upkeep.due) wake_runner(upkeep.suspects_due);
  return upkeep.more;
}

}  // namespace jobs
