#include "server/queue/queue.h"

#include <algorithm>
#include <utility>

#include "api/batch.h"

namespace queue {
namespace {

using Announcement = JobNotifications::PendingAnnouncement;

constexpr int page_jobs = 1000;
constexpr int maintenance_step = 100;  // jobs of each kind: some milliseconds of the one writer

constexpr std::int64_t position_max = 1000;  // counting walks an index

/// Until the running jobs have ended, and then this work.
std::optional<double> eta_s(QueueContext& context, double work) {
  const std::optional<double> seconds_per_work = context.throughput.seconds_per_work();
  if (!seconds_per_work) return std::nullopt;
  return *seconds_per_work * (work + context.running.remaining_work());
}

}  // namespace

void add_position(QueueContext& context, JobView& view) {
  const std::optional<JobsBefore> before = context.stores.statistics.queue_position(view.job.id, position_max);
  if (!before || before->jobs >= position_max) return;
  view.queue_position = before->jobs + 1;
  view.waiting_eta_s = eta_s(context, static_cast<double>(before->work + view.job.work));
}

// ---- JobLifecycle

JobLifecycle::JobLifecycle(QueueContext& context, const Log& log) : context_(context) {
  const int recovered = context_.stores.maintenance.recover(context_.boot_id, context_.clock());
  for (const std::string& batch : context_.stores.batches.list_failing()) cancel_batch(batch);
  if (recovered > 0) log(LogLevel::info, "jobs_recovered", {{"count", std::to_string(recovered)}});
  seed_throughput_estimate();
}

/// From recently finished jobs in the store, as if each had run alone.
void JobLifecycle::seed_throughput_estimate() {
  JobFilter filter;
  filter.state = JobState::succeeded;
  JobPage page = context_.stores.jobs.list(filter, {}, ThroughputEstimate::jobs_max);
  std::ranges::reverse(page.items);
  for (const Job& job : page.items) {
    if (job.attempt == 0 || job.work == 0 || *job.ended_at <= *job.started_at) continue;
    const double seconds = static_cast<double>(*job.ended_at - *job.started_at) / 1000;
    context_.throughput.add(seconds, static_cast<double>(job.work), 1);
  }
}

// JobLifecycle, for the runner

std::optional<Claim> JobLifecycle::claim(const ClaimFilter& filter) {
  if (context_.settings.disk_space().state == DiskSpace::State::none) return std::nullopt;
  for (;;) {
    const std::int64_t now = context_.clock();
    const ClaimTerms terms{context_.boot_id, now + context_.settings.lease_ms};
    auto claim = context_.stores.transitions.claim(terms, now, filter);
    if (!claim) return claim;
    if (claim->scene) {  // a patch that does not apply was not accepted; the worker reports it as bad_scene
      claim->document = api::apply_patch(*claim->scene, claim->document).value_or(claim->document);
      claim->scene.reset();
    }
    const Job& job = claim->job;
    if (context_.notifications.notify_claimed(*claim)) continue;
    if (!job.use_cache || !finish_as_duplicate({job.id, claim->fence}, job.content_key)) return claim;
  }
}

/// Ends a claimed job with the images of an equal one, if they exist.
bool JobLifecycle::finish_as_duplicate(const Lease& lease, const std::string& content_key) {
  const std::optional<Job> equal = context_.stores.jobs.find_by_content_key(content_key, context_.clock());
  if (!equal || equal->artifacts.empty()) return false;
  ArtifactPins::Pinned pinned(context_.pins);
  const bool durable = context_.running.is_durable(lease.job_id);
  if (!pinned.hold(equal->artifacts, durable && !equal->artifacts_synced)) return false;
  const bool ended = context_.stores.transitions.succeed(lease.job_id, lease.fence, context_.clock(), equal->report,
                                                         equal->artifacts, durable, false);
  finish(lease, ended, {lease.job_id, JobState::succeeded});
  return true;
}

/// Ends the jobs that follow one which has ended, or returns them to the queue.
void JobLifecycle::end_followers(const std::string& id) {
  const RunningJobs::Followers followers = context_.running.take_followers(id);
  for (const Lease& lease : followers.leases) {
    try {
      if (!finish_as_duplicate(lease, followers.content_key)) release(lease.job_id, lease.fence, {});
    } catch (const StoreFailure&) {
      context_.running.end_lease(lease.job_id, lease.fence);  // maintenance queues it again when the lease has ended
    }
  }
  if (!followers.leases.empty()) context_.runner.notify();
}

bool JobLifecycle::cancel_follower(const std::string& id) {
  const std::optional<Lease> lease = context_.running.stop_following(id);
  return lease && finish_cancel(id, lease->fence);
}

bool JobLifecycle::succeed(const std::string& id, std::int64_t fence, const std::string& report,
                           const std::vector<Image>& images, const std::optional<api::ReportFigures>& figures) {
  ArtifactPins::Pinned pinned(context_.pins);
  const bool durable = context_.running.is_durable(id);
  const std::vector<Artifact> artifacts = store_images(pinned, images, durable);
  const std::int64_t now = context_.clock();
  const bool ended = context_.stores.transitions.succeed(id, fence, now, report, artifacts, durable);
  if (ended) {
    pinned.named();
    context_.running.add_duration(id, now, context_.throughput);
  }
  // make_durable was called meanwhile, and its caller may have read the job as running.
  if (!durable && context_.running.is_durable(id)) store_images(pinned, images, true);
  return finish({id, fence}, ended, {id, JobState::succeeded, context_.running.run_until(id, now), figures});
}

std::vector<Artifact> JobLifecycle::store_images(ArtifactPins::Pinned& pinned, const std::vector<Image>& images,
                                                 bool durable) {
  std::vector<Artifact> artifacts;
  for (const Image& image : images) {
    const ArtifactStore::Stored stored = pinned.put(image.fd, durable);
    artifacts.push_back({image.name, image.media_type, stored.sha256, stored.bytes});
  }
  return artifacts;
}

bool JobLifecycle::fail(const std::string& id, std::int64_t fence, const Problem& problem) {
  const std::int64_t now = context_.clock();
  const bool ended = context_.stores.transitions.fail(id, fence, now, problem);
  if (finish({id, fence}, ended, {id, JobState::failed, context_.running.run_until(id, now)})) cancel_failing_batch(id);
  return ended;
}

bool JobLifecycle::finish_cancel(const std::string& id, std::int64_t fence) {
  const std::int64_t now = context_.clock();
  const bool ended = context_.stores.transitions.finish_cancel(id, fence, now);
  return finish({id, fence}, ended, {id, JobState::cancelled, context_.running.run_until(id, now)});
}

bool JobLifecycle::keep_preview(const std::string& id, std::int64_t fence, int fd) {
  ArtifactPins::Pinned pinned(context_.pins);
  const Artifact preview = store_images(pinned, {{"preview.png", "image/png", fd}}, true).front();
  return context_.stores.transitions.add_artifact(id, fence, preview);
}

/// `ended`: the transition of the store took place.
bool JobLifecycle::finish(const Lease& lease, bool ended, const EndedJob& job) {
  context_.running.end_lease(lease.job_id, lease.fence);
  if (!ended) return false;
  context_.notifications.notify_end(job);
  end_followers(job.id);
  return true;
}

bool JobLifecycle::release(const std::string& id, std::int64_t fence, const Release& release) {
  context_.running.clear_progress(id);
  context_.waiters.on_stopped(id);
  auto announcement = std::make_unique<Announcement>(context_.notifications, std::vector{id});
  const ReleaseOutcome outcome = context_.stores.transitions.release(id, fence, context_.clock(), release);
  context_.running.end_lease(id, fence);
  if (outcome == ReleaseOutcome::cancelled) announcement.reset();  // it was not queued
  if (outcome == ReleaseOutcome::cancelled) context_.notifications.notify_end({id, JobState::cancelled});
  if (outcome == ReleaseOutcome::queued) context_.notifications.notify_queued(id);
  if (outcome == ReleaseOutcome::queued && release.pause_ms == 0) context_.runner.notify(release.suspect);
  end_followers(id);
  return outcome != ReleaseOutcome::stale;
}

void JobLifecycle::set_progress(const std::string& id, double fraction) {
  const auto progress = context_.running.set_progress(id, fraction);
  if (progress) context_.notifications.notify_progress(id, *progress);
}

void JobLifecycle::renew_leases() {
  const std::vector<Lease> held = context_.running.leases();
  if (held.empty()) return;
  const std::int64_t until = context_.clock() + context_.settings.lease_ms;
  for (const Lease& lost : context_.stores.transitions.renew(held, until)) {
    context_.running.end_lease(lost.job_id, lost.fence);
    context_.runner.call([&](JobRunner& runner) { runner.on_lease_lost(lost); });
  }
}

// JobLifecycle, for owners

CancelOutcome JobLifecycle::cancel(const std::string& id, bool durable) {
  const CancelOutcome outcome = context_.stores.transitions.cancel(id, context_.clock(), durable);
  if (outcome == CancelOutcome::cancelled) context_.notifications.notify_end({id, JobState::cancelled});
  if (outcome == CancelOutcome::cancelling && !cancel_follower(id)) context_.runner.cancel(id);
  return outcome;
}

RemoveOutcome JobLifecycle::remove(const std::string& id, bool durable) {
  const Removal removal = context_.stores.jobs.remove(id, durable);
  if (removal.outcome == RemoveOutcome::removed) {
    context_.notifications.notify_removed(removal.job);
    collect(removal.artifacts);
  }
  return removal.outcome;
}

void JobLifecycle::collect(const std::vector<Artifact>& artifacts) {
  for (const Artifact& artifact : artifacts) context_.pins.collect(artifact.sha256);
}

bool JobLifecycle::has_all_images(const Job& job) {
  return std::ranges::all_of(job.artifacts, [&](const auto& artifact) { return context_.pins.is_intact(artifact); });
}

RetryOutcome JobLifecycle::retry(const std::string& id, bool durable) {
  const Announcement announcement(context_.notifications, {id});
  const std::optional<Job> before = context_.stores.jobs.find(id);
  RetryOutcome outcome = context_.stores.transitions.retry(id, context_.clock(), SucceededJobs::keep, durable);
  if (outcome == RetryOutcome::succeeded) {
    const std::optional<Job> damaged = context_.stores.jobs.find(id);
    if (!damaged || has_all_images(*damaged)) return outcome;
    outcome = context_.stores.transitions.retry(id, context_.clock(), SucceededJobs::retry);
  }
  if (outcome == RetryOutcome::queued) {
    if (before) collect(before->artifacts);
    const std::optional<Job> job = context_.stores.jobs.find(id);
    context_.notifications.notify_queued(id);
    context_.runner.notify(job && job->suspect);
  }
  return outcome;
}

ChangeOutcome JobLifecycle::change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision,
                                   bool durable) {
  const ChangeOutcome outcome = context_.stores.jobs.change(id, change, revision, durable);
  if (outcome == ChangeOutcome::changed) {
    // The state is the same, but long polls wait for any change.
    const std::optional<Job> job = context_.stores.jobs.find(id);
    if (job && !ended(job->state)) {
      context_.notifications.describe(*job);
      context_.notifications.notify_state(id, job->state);
    }
  }
  return outcome;
}

void JobLifecycle::cancel_batch(const std::string& id) {
  const BatchCancel changed = context_.stores.batches.cancel(id, context_.clock());
  for (const std::string& job : changed.cancelled) context_.notifications.notify_end({job, JobState::cancelled});
  for (const std::string& job : changed.cancelling) {
    if (!cancel_follower(job)) context_.runner.cancel(job);
  }
}

int JobLifecycle::retry_batch(const std::string& id) {
  std::vector<std::string> candidates;
  std::vector<Artifact> previews;
  JobFilter filter;
  filter.batch = id;
  for (const JobState state : {JobState::failed, JobState::cancelled}) {
    filter.state = state;
    std::string cursor;
    do {
      const JobPage page = context_.stores.jobs.list(filter, cursor, page_jobs);
      for (const Job& job : page.items) {
        candidates.push_back(job.id);
        previews.insert(previews.end(), job.artifacts.begin(), job.artifacts.end());
      }
      cursor = page.next_cursor;
    } while (!cursor.empty());
  }
  const Announcement announcement(context_.notifications, std::move(candidates));
  const BatchRetry retried = context_.stores.batches.retry(id, context_.clock());
  for (const std::string& job : retried.jobs) context_.notifications.notify_queued(job);
  collect(previews);
  if (!retried.jobs.empty()) context_.runner.notify(retried.suspects);
  return static_cast<int>(retried.jobs.size());
}

bool JobLifecycle::remove_batch(const std::string& id) {
  BatchRemoval removal;
  do {  // in small steps, so that others write between them
    removal = context_.stores.batches.remove_ended(id, maintenance_step);
    for (const JobSummary& job : removal.jobs) context_.notifications.notify_removed(job);
    collect(removal.artifacts);
  } while (!removal.jobs.empty());
  return !context_.stores.batches.find(id);
}

/// Called after the end of a job that failed.
void JobLifecycle::cancel_failing_batch(const std::string& job_id) {
  const std::optional<Job> job = context_.stores.jobs.find(job_id);
  if (!job || job->batch.empty()) return;
  const std::optional<BatchState> state = context_.stores.batches.find(job->batch);
  if (!state || !state->batch.max_failed) return;
  if (state->count(JobState::failed) > *state->batch.max_failed) cancel_batch(job->batch);
}

// JobLifecycle, for the daemon

bool JobLifecycle::run_maintenance() {
  const std::int64_t now = context_.clock();
  Retention retention = context_.settings.retention;
  if (context_.cluster != nullptr) {
    // While the store was away no node could renew its leases; all do so as soon as it is back.
    const std::int64_t lease_ms = context_.settings.lease_ms, outage_ms = std::max<std::int64_t>(lease_ms / 6, 2000);
    if (maintained_at_ != 0 && now - maintained_at_ > pause_ms_ + outage_ms) grace_until_ = now + lease_ms / 2;
    if (now < grace_until_) retention.lease_grace_ms = 24 * 3600 * 1000;
  }
  const MaintenanceResult result = context_.stores.maintenance.run_maintenance(now, retention, maintenance_step);
  maintained_at_ = now;
  for (const std::string& id : result.abandoned) {
    context_.running.clear_progress(id);
    context_.waiters.on_stopped(id);
    (void)context_.running.stop_following(id);
    end_followers(id);
    context_.notifications.notify_queued_again(id, [&] {
      const std::optional<Job> job = context_.stores.jobs.find(id);
      return job && job->state == JobState::queued;
    });
  }
  for (const std::string& id : result.cancelled) context_.notifications.notify_end({id, JobState::cancelled});
  for (const std::string& id : result.overdue) context_.notifications.notify_end({id, JobState::failed});
  for (const std::string& id : result.overdue) cancel_failing_batch(id);
  collect(result.artifacts);
  context_.notifications.notify_expired("expires_at", result.expired);
  context_.notifications.notify_expired("age", result.aged);
  context_.notifications.notify_expired("artifact_bytes", result.evicted);
  const bool abandoned = !result.abandoned.empty();
  // Nodes look for suspects by themselves (NodeLink), as all of them would wait until they are idle.
  const bool may_be_suspect = abandoned && !context_.runner.is_connected();
  if (result.due || abandoned) context_.runner.notify(result.suspects_due || may_be_suspect);
  return result.more;
}

std::chrono::milliseconds JobLifecycle::maintenance_pause(std::chrono::milliseconds interval) {
  constexpr int nodes_max = 20;  // so that a node that is the only one left does the work of all within seconds
  const std::chrono::milliseconds pause = interval * std::clamp(context_.nodes.load(), 1, nodes_max);
  pause_ms_ = pause.count();
  return pause;
}

// ---- JobQueries

std::optional<JobView> JobQueries::find(const std::string& id) {
  std::optional<Job> job = context_.stores.jobs.find(id);
  if (!job) return std::nullopt;
  const double fraction = job->state == JobState::succeeded ? 1 : progress(id);
  JobView view{*std::move(job), fraction};
  if (view.job.state == JobState::queued) add_position(context_, view);
  if (view.job.state == JobState::running) view.measurement = context_.running.measurement(id);
  if (view.job.state == JobState::running && view.job.kind == JobKind::measure && view.measurement.empty() &&
      context_.cluster != nullptr) {
    view.measurement = context_.cluster->find_result(id, measurement_result).value_or("");
  }
  return view;
}

std::optional<std::string> JobQueries::document(const std::string& id) {
  std::optional<std::string> document = context_.stores.jobs.document(id);
  const std::optional<std::string> scene = document ? context_.stores.jobs.scene(id) : std::nullopt;
  return scene ? api::apply_patch(*scene, *document) : document;
}

JobPage JobQueries::list(const JobFilter& filter, const std::string& cursor, int limit) {
  return context_.stores.jobs.list(filter, cursor, std::max(limit, 1));
}

QueueState JobQueries::state() {
  QueueState state;
  state.depth = context_.stores.statistics.depth();
  for (const JobState which : all_job_states) state.jobs[which] = context_.stores.statistics.count(which);
  if (state.depth.oldest_at) {
    state.oldest_age_s =
        static_cast<double>(std::max<std::int64_t>(context_.clock() - *state.depth.oldest_at, 0)) / 1000;
  }
  state.eta_s = eta_s(context_, static_cast<double>(state.depth.work));
  const double running_s = context_.running.remaining_s(context_.clock());
  if (running_s > state.eta_s.value_or(0)) state.eta_s = running_s;
  return state;
}

std::string JobQueries::not_ready() {
  if (const DiskSpace space = context_.settings.disk_space(); space.state != DiskSpace::State::enough)
    return "disk: " + describe(space);
  try {
    context_.stores.maintenance.probe();
  } catch (const StoreFailure& failure) {
    return std::string("store: ") + failure.what();
  }
  std::string reason = "worker: not started";
  context_.runner.call([&](JobRunner& runner) { reason = runner.not_ready(); });
  return reason;
}

}  // namespace queue
