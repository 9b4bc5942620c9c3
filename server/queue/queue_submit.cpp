/// How jobs come into the queue: within its bounds, once for each Idempotency-Key, from the result cache where that has
/// them.

#include <utility>

#include "api/document.h"
#include "api/estimate.h"
#include "server/queue/pending_announcement.h"
#include "server/queue/queue.h"

namespace queue {
namespace {

ReplyKey key_of(const std::string& owner, const std::optional<Idempotency>& idempotency) {
  return idempotency ? ReplyKey{owner, idempotency->route, idempotency->key} : ReplyKey{};
}

std::vector<std::string> uploads_of(const tracer::Scene& scene) {
  std::vector<std::string> hashes;
  for (const tracer::Asset& asset : scene.assets) {
    if (asset.name.starts_with(api::upload_prefix)) hashes.push_back(asset.name.substr(api::upload_prefix.size()));
  }
  return hashes;
}

/// Whether an earlier request under the same key was the same.
template <class Answer>
tracer::Result<Answer, Refused> replay(const KeptReply& kept, const Idempotency& idempotency) {
  if (kept.request_sha256 != idempotency.request_sha256) return Refused{Refused::Why::key_reused, 0, 0};
  Answer answer;
  answer.replayed = kept.reply;
  return answer;
}

}  // namespace

std::optional<Refused> Queue::enter(const std::string& owner, std::int64_t jobs) {
  if (const DiskSpace room = room_ ? room_() : DiskSpace{}; room.state != DiskSpace::State::enough) {
    return Refused{Refused::Why::disk_full, static_cast<std::int64_t>(room.free_bytes),
                   static_cast<std::int64_t>(room.reserve_bytes)};
  }
  const std::lock_guard lock(submit_mutex_);
  std::int64_t submitting = 0;
  for (const auto& [name, count] : submitting_) submitting += count;
  const std::int64_t queued = store_.count(JobState::queued) + submitting;
  if (queued + jobs > settings_.queued_limit) return Refused{Refused::Why::queue_full, queued, settings_.queued_limit};
  const OwnerUse use = store_.owner_usage(owner);
  const auto of_owner = submitting_.find(owner);
  const std::int64_t owners = use.queued_jobs + (of_owner == submitting_.end() ? 0 : of_owner->second);
  if (owners + jobs > settings_.owner_queued_limit) {
    return Refused{Refused::Why::owner_queued_jobs, owners, settings_.owner_queued_limit};
  }
  if (use.artifact_bytes >= settings_.owner_artifact_bytes_limit) {
    return Refused{Refused::Why::owner_artifact_bytes, use.artifact_bytes, settings_.owner_artifact_bytes_limit};
  }
  submitting_[owner] += jobs;
  return std::nullopt;
}

void Queue::leave(const std::string& owner, std::int64_t jobs) {
  const std::lock_guard lock(submit_mutex_);
  const auto found = submitting_.find(owner);
  if ((found->second -= jobs) == 0) submitting_.erase(found);
}

/// What is admitted counts at once, so that many threads together cannot pass the bounds.
class Queue::InsertResult {
 public:
  InsertResult(Queue& queue, std::string owner, std::size_t jobs)
      : queue_(queue),
        owner_(std::move(owner)),
        jobs_(static_cast<std::int64_t>(jobs)),
        refused_(queue.enter(owner_, jobs_)) {}
  ~InsertResult() {
    if (!refused_) queue_.leave(owner_, jobs_);
  }
  InsertResult(const InsertResult&) = delete;
  InsertResult& operator=(const InsertResult&) = delete;
  [[nodiscard]] const std::optional<Refused>& refused() const { return refused_; }

 private:
  Queue& queue_;
  std::string owner_;
  std::int64_t jobs_;
  std::optional<Refused> refused_;
};

Job Queue::job_of(const Submission& submission) {
  const api::JobRequest& asked = submission.parsed.job;
  Job job;
  job.id = ids_.next();
  job.kind = submission.kind;
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
  job.accuracy = submission.accuracy;
  job.large = job.kind == JobKind::measure || api::is_large(submission.parsed.scene);
  job.assets = uploads_of(submission.parsed.scene);
  if (asked.cache != api::CacheUse::off) job.content_key = submission.content_key;
  return job;
}

/// Ends a job that is not stored yet with the images of an equal one, if those are there to stay.
bool Queue::finish_from_cache(Job& job, ArtifactPins::Pinned& pinned) {
  const std::optional<Job> equal = store_.find_by_content_key(job.content_key, job.created_at);
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

/// Succeeded already where its images are there.
NewJob Queue::new_job(Submission submission, ArtifactPins::Pinned& pinned) {
  NewJob fresh{job_of(submission), std::move(submission.document)};
  const bool may_use = submission.parsed.job.cache == api::CacheUse::use && !fresh.job.content_key.empty();
  if (may_use) finish_from_cache(fresh.job, pinned);
  return fresh;
}

/// Before the job is stored: none ends untold.
void Queue::expect_webhook(const Job& job) {
  CompletionListener* const listener = listener_;
  if (job.webhook && listener != nullptr) listener->expect(job.id, *job.webhook);
}

/// After it was stored: it waits, or had its images already.
void Queue::notify_arrived(const Job& job) {
  if (!ended(job.state)) return notify_queued(job.id);
  tell_end(job.id, job.state);
}

void Queue::tell_runner_of_one() {
  const std::shared_lock lock(runner_mutex_);
  if (runner_ != nullptr) runner_->on_job_available();
}

tracer::Result<Submitted, Refused> Queue::submit(Submission submission) {
  const std::optional<Idempotency> idempotency = std::move(submission.idempotency);
  const ReplyKey key = key_of(submission.owner, idempotency);
  if (idempotency) {
    if (const auto kept = store_.reply(key, clock_())) return replay<Submitted>(*kept, *idempotency);
  }
  const InsertResult admitted(*this, submission.owner, 1);
  if (admitted.refused()) return *admitted.refused();

  const auto write_reply = std::move(submission.write_reply);
  ArtifactPins::Pinned pinned(pins_);
  InsertRequest admission;
  admission.durable = submission.durable || idempotency;
  const Job& job = admission.jobs.emplace_back(new_job(std::move(submission), pinned)).job;
  const bool from_cache = job.state == JobState::succeeded;
  const JobView made{job, from_cache ? 1.0 : 0.0};
  if (idempotency) {
    admission.reply = KeptReply{key, idempotency->request_sha256, write_reply(made, from_cache),
                                job.created_at + settings_.reply_kept_ms};
  }
  expect_webhook(job);
  if (!admission.durable && !from_cache) {  // what has ended is forgotten here
    const std::lock_guard lock(live_mutex_);
    not_durable_.insert(job.id);
  }
  const PendingAnnouncement arrival(*this, from_cache ? std::vector<std::string>{} : std::vector{job.id});
  try {
    if (const auto earlier = store_.insert_job(admission, job.created_at))
      return replay<Submitted>(*earlier, *idempotency);
  } catch (...) {
    const std::lock_guard lock(live_mutex_);
    not_durable_.erase(job.id);
    throw;
  }
  notify_arrived(made.job);
  // Of a job for later the housekeeper tells in time. That it wakes the runner, too, only spreads submissions out, so
  // that more of them share a sync: on a busy machine an eighth more a second.
  if (!from_cache && job.not_before) wake_runner();
  if (!from_cache && !job.not_before) tell_runner_of_one();
  return Submitted{made, from_cache, std::nullopt};
}

tracer::Result<BatchSubmitted, Refused> Queue::submit_batch(BatchSubmission submission) {
  const std::optional<Idempotency>& idempotency = submission.idempotency;
  const ReplyKey key = key_of(submission.owner, idempotency);
  if (idempotency) {
    if (const auto kept = store_.reply(key, clock_())) return replay<BatchSubmitted>(*kept, *idempotency);
  }
  const InsertResult admitted(*this, submission.owner, submission.jobs.size());
  if (admitted.refused()) return *admitted.refused();

  ArtifactPins::Pinned pinned(pins_);
  InsertRequest admission;
  const int size = static_cast<int>(submission.jobs.size());
  const Batch batch{ids_.next(), submission.owner, submission.name, clock_(), submission.max_failed, size};
  admission.batch = batch;
  BatchState state{batch, {}};
  for (Submission& job : submission.jobs) {
    NewJob& fresh = admission.jobs.emplace_back(new_job(std::move(job), pinned));
    fresh.job.batch = batch.id;
    fresh.job.batch_index = static_cast<int>(admission.jobs.size()) - 1;
    ++state.jobs[fresh.job.state];
  }
  if (idempotency) {
    admission.reply = KeptReply{key, idempotency->request_sha256, submission.write_reply(state),
                                batch.created_at + settings_.reply_kept_ms};
  }
  std::vector<std::string> waiting;
  for (const auto& [job, document] : admission.jobs) {
    expect_webhook(job);
    if (!ended(job.state)) waiting.push_back(job.id);
  }
  const PendingAnnouncement arrival(*this, std::move(waiting));
  if (const auto earlier = store_.insert_job(admission, batch.created_at)) {
    return replay<BatchSubmitted>(*earlier, *idempotency);
  }
  for (const auto& [job, document] : admission.jobs) notify_arrived(job);
  wake_runner();
  return BatchSubmitted{std::move(state), std::nullopt};
}

}  // namespace queue
