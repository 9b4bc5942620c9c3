#include <utility>
#include <vector>

#include "server/queue/queue.h"

namespace queue {
namespace {

using Announcement = JobNotifications::PendingAnnouncement;

ReplyKey key_of(const std::string& owner, const std::optional<Idempotency>& idempotency) {
  return idempotency ? ReplyKey{owner, idempotency->route, idempotency->key} : ReplyKey{};
}

/// Rejected where the earlier request under the same key was another one.
template <class Result>
tracer::Result<Result, Rejection> replay(const KeptReply& kept, const Idempotency& idempotency) {
  if (kept.request_sha256 != idempotency.request_sha256) return Rejection{Rejection::Reason::key_reused, 0, 0};
  Result result;
  result.replayed = kept.reply;
  return result;
}

}  // namespace

std::optional<Rejection> JobSubmission::reserve(const std::string& owner, std::int64_t jobs) {
  using Reason = Rejection::Reason;
  const QueueSettings& settings = context_.settings;
  if (const DiskSpace space = settings.disk_space(); space.state != DiskSpace::State::enough) {
    return Rejection{Reason::disk_full, static_cast<std::int64_t>(space.free_bytes),
                     static_cast<std::int64_t>(space.reserve_bytes)};
  }
  const std::lock_guard lock(mutex_);
  std::int64_t reserved = 0;
  for (const auto& [name, count] : reserved_) reserved += count;
  const OwnerUsage usage = context_.stores.statistics.owner_usage(owner);
  const std::int64_t queued = usage.all_queued_jobs + reserved;
  if (queued + jobs > settings.queued_limit) return Rejection{Reason::queue_full, queued, settings.queued_limit, jobs};
  const auto of_owner = reserved_.find(owner);
  const std::int64_t owners = usage.queued_jobs + (of_owner == reserved_.end() ? 0 : of_owner->second);
  if (owners + jobs > settings.owner_queued_limit) {
    return Rejection{Reason::owner_queued_jobs, owners, settings.owner_queued_limit, jobs};
  }
  if (usage.artifact_bytes >= settings.owner_artifact_bytes_limit) {
    return Rejection{Reason::owner_artifact_bytes, usage.artifact_bytes, settings.owner_artifact_bytes_limit};
  }
  reserved_[owner] += jobs;
  return std::nullopt;
}

/// Admitted jobs count at once, so that many threads together cannot exceed the limits.
class JobSubmission::QuotaReservation {
 public:
  QuotaReservation(JobSubmission& submission, std::string owner, std::size_t jobs)
      : submission_(submission),
        owner_(std::move(owner)),
        jobs_(static_cast<std::int64_t>(jobs)),
        rejection_(submission.reserve(owner_, jobs_)) {}
  ~QuotaReservation() {
    if (rejection_) return;
    const std::lock_guard lock(submission_.mutex_);
    const auto found = submission_.reserved_.find(owner_);
    if ((found->second -= jobs_) == 0) submission_.reserved_.erase(found);
  }
  QuotaReservation(QuotaReservation&&) = delete;
  [[nodiscard]] const std::optional<Rejection>& rejection() const { return rejection_; }

 private:
  JobSubmission& submission_;
  std::string owner_;
  std::int64_t jobs_;
  std::optional<Rejection> rejection_;
};

/// Ends a job that is not stored yet with the images of an equal one, if they exist.
bool JobSubmission::finish_from_cache(Job& job, ArtifactPins::Pinned& pinned, bool durable) {
  const std::optional<Job> equal = context_.stores.jobs.find_by_content_key(job.content_key, job.created_at);
  if (!equal || equal->artifacts.empty()) return false;
  const bool sync = durable && !equal->artifacts_synced;
  if (!pinned.hold(equal->artifacts, sync)) return false;
  job.started_at = job.created_at;
  job.state = JobState::running;
  end(job, JobState::succeeded, job.created_at);
  job.report = equal->report;
  job.artifacts = equal->artifacts;
  job.artifacts_synced = sync || equal->artifacts_synced;
  return true;
}

NewJob JobSubmission::new_job(Submission submission, ArtifactPins::Pinned& pinned) {
  NewJob fresh{std::move(submission.job), std::move(submission.document)};
  Job& job = fresh.job;
  job.id = context_.ids.next();
  job.created_at = context_.clock();
  if (job.run_after && *job.run_after > job.created_at) job.not_before = job.run_after;
  if (job.cache == api::CacheUse::off) job.content_key.clear();
  job.use_cache = job.cache == api::CacheUse::use && !job.content_key.empty();
  if (job.use_cache) finish_from_cache(job, pinned, submission.durable);
  return fresh;
}

void JobSubmission::notify_stored(const Job& job) {
  if (!ended(job.state)) return context_.notifications.notify_queued(job.id);
  context_.notifications.notify_end({job.id, job.state});
}

void JobSubmission::make_durable(const std::string& id) {
  if (context_.running.is_durable(id)) return;
  context_.running.set_durable(id, true);
  context_.stores.maintenance.probe();
}

tracer::Result<Submitted, Rejection> JobSubmission::submit(Submission submission) {
  JobStore& jobs = context_.stores.jobs;
  const std::optional<Idempotency> idempotency = std::move(submission.idempotency);
  const ReplyKey key = key_of(submission.job.owner, idempotency);
  if (idempotency) {
    if (const auto kept = jobs.find_reply(key, context_.clock())) return replay<Submitted>(*kept, *idempotency);
  }
  const QuotaReservation reservation(*this, submission.job.owner, 1);
  if (reservation.rejection()) return *reservation.rejection();

  submission.durable = submission.durable || idempotency;
  const bool with_position = submission.with_position;
  const auto write_reply = std::move(submission.write_reply);
  ArtifactPins::Pinned pinned(context_.pins);
  InsertRequest request;
  request.durable = submission.durable;
  const Job& job = request.jobs.emplace_back(new_job(std::move(submission), pinned)).job;
  const bool from_cache = job.state == JobState::succeeded;
  JobView view{job, from_cache ? 1.0 : 0.0};
  if (idempotency) {
    request.reply = KeptReply{key, idempotency->request_sha256, write_reply(view, from_cache),
                              job.created_at + context_.settings.reply_kept_ms};
  }
  context_.notifications.prepare(job);
  if (!request.durable && !from_cache) context_.running.set_durable(job.id, false);
  const Announcement announcement(context_.notifications,
                                  from_cache ? std::vector<std::string>{} : std::vector{job.id});
  try {
    if (const auto earlier = jobs.insert(request, job.created_at)) return replay<Submitted>(*earlier, *idempotency);
    notify_stored(job);
    if (with_position && !from_cache && !request.reply) add_position(context_, view);
    if (!from_cache && !job.not_before) context_.runner.notify();  // otherwise run_maintenance notifies it in time
  } catch (...) {
    context_.running.set_durable(job.id, true);
    throw;
  }
  return Submitted{view, from_cache, std::nullopt};
}

tracer::Result<BatchSubmitted, Rejection> JobSubmission::submit_batch(BatchSubmission submission) {
  JobStore& jobs = context_.stores.jobs;
  const std::optional<Idempotency>& idempotency = submission.idempotency;
  const ReplyKey key = key_of(submission.batch.owner, idempotency);
  if (idempotency) {
    if (const auto kept = jobs.find_reply(key, context_.clock())) return replay<BatchSubmitted>(*kept, *idempotency);
  }
  const QuotaReservation reservation(*this, submission.batch.owner, submission.jobs.size());
  if (reservation.rejection()) return *reservation.rejection();

  ArtifactPins::Pinned pinned(context_.pins);
  InsertRequest request;
  Batch batch = std::move(submission.batch);
  batch.id = context_.ids.next();
  batch.created_at = context_.clock();
  batch.size = static_cast<int>(submission.jobs.size());
  request.batch = batch;
  request.scene = std::move(submission.scene);
  BatchState state{batch, {}};
  for (Submission& job : submission.jobs) {
    NewJob& fresh = request.jobs.emplace_back(new_job(std::move(job), pinned));
    fresh.job.batch = batch.id;
    fresh.job.batch_index = static_cast<int>(request.jobs.size()) - 1;
    ++state.jobs[fresh.job.state];
  }
  if (idempotency) {
    request.reply = KeptReply{key, idempotency->request_sha256, submission.write_reply(state),
                              batch.created_at + context_.settings.reply_kept_ms};
  }
  std::vector<std::string> queued;
  for (const auto& [job, document] : request.jobs) {
    context_.notifications.prepare(job);
    if (!ended(job.state)) queued.push_back(job.id);
  }
  const Announcement announcement(context_.notifications, std::move(queued));
  if (const auto earlier = jobs.insert(request, batch.created_at))
    return replay<BatchSubmitted>(*earlier, *idempotency);
  for (const auto& [job, document] : request.jobs) notify_stored(job);
  context_.runner.notify();
  return BatchSubmitted{std::move(state), std::nullopt};
}

}  // namespace queue
