#include "server/worker/supervisor/job_dispatcher.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "server/worker/supervisor/message_check.h"

namespace worker {

using queue::LogLevel;

namespace {

constexpr const char* unknown_job = "answered a job that it does not run";

/// True once, when the time has come.
bool has_come(std::optional<Time>& time, Time now) {
  if (!time || now < *time) return false;
  time.reset();
  return true;
}

/// True if an earlier claim of the job has left results of tasks.
bool resumes(const queue::Claim& claim, queue::TaskStore* tasks) {
  return tasks != nullptr && claim.fence > 1 && !tasks->finished(claim.job.id).empty();
}

}  // namespace

// ---- claims

void JobDispatcher::on_jobs_available(bool suspects) noexcept {
  if (suspects) suspects_available_ = true;
  ++notifications_;
}

void JobDispatcher::claim_jobs(Time now) {
  if (!settings_.claims_jobs || process_.state() != WorkerState::ready || draining_ || now < claims_paused_until_)
    return;
  suspects_first_ = suspects_first_ || suspects_available_;
  if (suspects_first_) {
    if (!idle()) return;
    suspects_available_ = false;  // only here: a claim under way may miss the jobs of a later notification
    start_claim(ClaimKind::suspect);
    return;
  }
  while (claims_.none_left != notifications_ && has_slot(ClaimKind::any)) start_claim(ClaimKind::any);
  while (claims_.none_left_small != notifications_ && has_slot(ClaimKind::small)) start_claim(ClaimKind::small);
}

Time JobDispatcher::next_deadline(Time now) const {
  const Time next = slots_.next_deadline(process_.state() == WorkerState::ready);
  return claims_paused_until_ > now ? std::min(next, claims_paused_until_) : next;
}

bool JobDispatcher::has_slot(ClaimKind kind) const {
  const auto slots = static_cast<std::size_t>(settings_.slots);
  // One claim at a time until one leaves jobs behind: a single job does not occupy all threads. Also if owners have a
  // limit, which several claims could exceed.
  if (claims_.count > 0 && (!claims_.more_wait || settings_.owner_slots < settings_.slots)) return false;
  // Finished images wait in memory for the store; the limit makes the worker wait for a slow store.
  const std::size_t pending_max = slots + static_cast<std::size_t>(settings_.store_threads);
  if (slots_.running.size() + claims_.count >= slots || outcomes_.pending() >= pending_max) return false;
  if (outcomes_.backlog().is_full()) return false;
  return kind == ClaimKind::small || slots_.has_slot_for_large(claims_.large_count);
}

void JobDispatcher::start_claim(ClaimKind kind) {
  ++claims_.count;
  if (kind == ClaimKind::any) ++claims_.large_count;
  executor_.run([this, kind, notifications = notifications_.load(), busy = slots_.busy_owners()] {
    ClaimResult result{.kind = kind, .notifications = notifications, .busy_owners = busy};
    try {
      result.claim = queue_.lifecycle.claim({.suspects = result.kind == ClaimKind::suspect,
                                             .small = result.kind == ClaimKind::small,
                                             .busy_owners = result.busy_owners});
      if (result.claim) {
        const queue::Job& job = result.claim->job;
        const auto queue_ms = static_cast<double>(std::max<std::int64_t>(*job.started_at - job.created_at, 0));
        result.assignment = pack(Assign{job.id, result.claim->fence, queue_ms,
                                        std::exchange(result.claim->document, {}), queue::name_of(job.kind), job.large,
                                        settings_.tasks != nullptr, resumes(*result.claim, settings_.tasks)});
      }
    } catch (const std::exception& failure) {
      result.failed = true;
      log_(LogLevel::error, result.claim ? "job_not_assigned" : "store_failure",
           {{"during", "claim"}, {"detail", failure.what()}});
    }
    events_.post([this, shared = std::make_shared<ClaimResult>(std::move(result))] { on_claimed(*shared); });
  });
}

void JobDispatcher::on_claimed(ClaimResult& result) {
  --claims_.count;
  if (result.kind == ClaimKind::any) --claims_.large_count;
  // If an excluded owner is below its limit again, its jobs may still be waiting.
  const bool none_left =
      (!result.claim || result.claim->is_last) &&
      std::ranges::all_of(result.busy_owners, [&](const std::string& owner) { return slots_.is_busy(owner); });
  if (result.failed) {
    claims_paused_until_ = Time::clock::now() + settings_.store_pause;
  } else {
    claims_.more_wait = !none_left;
  }
  if (result.claim) {
    const queue::Job& job = result.claim->job;
    const std::int64_t fence = result.claim->fence;
    if (early_cancels_.erase(job.id) > 0) {
      outcomes_.cancel(job.id, fence);
    } else if (result.failed || draining_ || process_.state() != WorkerState::ready) {
      release(job.id, fence, {.suspect = job.suspect});
    } else if (slots_.running.contains(job.id)) {  // it was retried before the worker has stopped its previous attempt
      release(job.id, fence, {.suspect = job.suspect, .pause_ms = settings_.retry.pause.count()});
    } else {
      slots_.add(job, fence, Time::clock::now());
      running_count_ = static_cast<int>(slots_.running.size());
      process_.send(std::move(result.assignment));
      log_(LogLevel::debug, "job_assigned", {{"job_id", job.id}, {"attempt", std::to_string(job.attempt)}});
    }
  } else if (!result.failed && result.kind == ClaimKind::suspect) {
    suspects_first_ = false;
  }
  if (none_left && !result.failed) {
    if (result.kind == ClaimKind::any) claims_.none_left = result.notifications;
    if (result.kind != ClaimKind::suspect) claims_.none_left_small = result.notifications;
    if (!result.busy_owners.empty()) claims_.owners_excluded = true;
  }
  if (claims_.count == 0) early_cancels_.clear();
}

// ---- running jobs

void JobDispatcher::cancel(const std::string& id) {
  const auto found = slots_.running.find(id);
  if (found == slots_.running.end()) {
    if (claims_.count > 0) early_cancels_.insert(id);
    return;
  }
  if (!std::exchange(found->second.job.cancel_requested, true)) stop(found->second);
}

void JobDispatcher::on_lease_lost(const queue::Lease& lease) {
  const auto found = slots_.running.find(lease.job_id);
  if (found == slots_.running.end() || found->second.fence != lease.fence) return;
  log_(LogLevel::warning, "lease_lost", {{"job_id", lease.job_id}});
  found->second.lease_lost = true;
  ++notifications_;  // the job may be queued again
  stop(found->second);
}

void JobDispatcher::stop(RunningJob& job) {
  const Time now = Time::clock::now();
  job.report_at = now + settings_.cancel_answer;
  if (job.kill_at) return;  // the worker is informed already
  job.kill_at = now + settings_.cancel_grace;
  process_.send(pack(Cancel{job.job.id, job.keeps_preview()}));
}

void JobDispatcher::check_deadlines(Time now) {
  for (auto& [id, job] : slots_.running) {
    if (!has_come(job.slow_at, now)) continue;
    job.job.large = true;
    job.large_since = now;
    log_(LogLevel::info, "job_became_large", {{"job_id", id}});
  }
  if (RunningJob* const surplus = slots_.surplus_large_job()) {
    surplus->yields_slot = true;
    stop(*surplus);
  }
  bool worker_must_end = false;
  for (auto& [id, job] : slots_.running) {
    if (has_come(job.stop_at, now)) {
      if (!job.job.cancel_requested) job.stopped_for = job.overdue;
      stop(job);
    }
    if (has_come(job.report_at, now)) {
      job.reported = true;
      report_stopped(job);
    }
    worker_must_end = worker_must_end || (job.kill_at && now >= *job.kill_at);
  }
  if (worker_must_end && process_.state() == WorkerState::ready) process_.end("did not stop a job", true);
}

void JobDispatcher::report_stopped(RunningJob& job) {
  if (job.lease_lost) return;
  const std::string& id = job.job.id;
  if (job.job.cancel_requested)
    outcomes_.cancel(id, job.fence);
  else if (job.stopped_for)
    retry_or_fail(job, *job.stopped_for);
  else
    release(id, job.fence, {.large = true, .code = "became_large"});  // it yields its slot
  if (job.last_preview) outcomes_.keep_preview(id, job.fence, *std::exchange(job.last_preview, std::nullopt));
}

void JobDispatcher::request_preview(const std::string& id, std::uint32_t side) {
  if (slots_.running.contains(id)) process_.send(pack(PreviewRequest{id, side}));
}

// ---- messages of the worker

void JobDispatcher::on_message(Message& message) {
  if (const auto* progress = std::get_if<Progress>(&message)) {
    if (progress->tiles_total == 0 || !slots_.running.contains(progress->job_id)) return;
    queue_.lifecycle.set_progress(
        progress->job_id,
        std::min(static_cast<double>(progress->tiles_done) / static_cast<double>(progress->tiles_total), 1.0));
  } else if (auto* preview = std::get_if<PreviewResponse>(&message)) {
    const auto found = slots_.running.find(preview->job_id);
    if (found == slots_.running.end()) return;
    RunningJob& job = found->second;
    // The last one may follow the report of the end, and a worker that does not stop sends no Cancelled.
    if (preview->side != queue::last_preview_side || !job.keeps_preview())
      queue_.waiters.add_preview(preview->job_id, preview->side, std::move(preview->png));
    else if (!job.reported)
      job.last_preview = std::move(preview->png);
    else if (std::exchange(job.job.keep, false))
      outcomes_.keep_preview(preview->job_id, job.fence, std::move(preview->png));
  } else if (auto* update = std::get_if<MeasurementUpdate>(&message)) {
    if (slots_.running.contains(update->job_id))
      queue_.lifecycle.set_measurement(update->job_id, std::move(update->summary));
  } else if (auto* finished = std::get_if<Finished>(&message)) {
    const auto found = slots_.running.find(finished->job_id);
    if (found == slots_.running.end()) return process_.end(unknown_job, false);
    const auto figures = check_result(*finished, found->second.job);
    if (!figures) return process_.end(figures.error(), false);
    const auto job = take(finished->job_id, finished->fence);
    if (!job) return;
    finished->figures = *figures;
    outcomes_.succeed(std::move(*finished),
                      [this, job = *job](const queue::Problem& problem) { retry_or_fail(job, problem); });
  } else if (const auto* failed = std::get_if<Failed>(&message)) {
    if (const auto job = take(failed->job_id, failed->fence)) retry_or_fail(*job, failed->problem);
  } else if (const auto* cancelled = std::get_if<Cancelled>(&message)) {
    auto job = take(cancelled->job_id, cancelled->fence);
    if (!job) return;
    if (job->is_stopping()) return report_stopped(*job);
    retry_or_fail(*job, {"internal", "The worker stopped the job without a request.", {}});
  }
}

/// None if the worker does not run the job. It answers each once, so that it is faulty then.
std::optional<RunningJob> JobDispatcher::take(const std::string& id, std::int64_t fence) {
  const auto found = slots_.running.find(id);
  if (found == slots_.running.end() || found->second.fence != fence) {
    process_.end(unknown_job, false);
    return std::nullopt;
  }
  if (claims_.owners_excluded && slots_.is_busy(found->second.job.owner)) {  // jobs of this owner may be claimed again
    claims_.owners_excluded = false;
    ++notifications_;
  }
  RunningJob job = std::move(found->second);
  slots_.running.erase(found);
  running_count_ = static_cast<int>(slots_.running.size());
  process_.reset_restart_pause();
  return job;
}

int JobDispatcher::on_worker_exit(const WorkerExit& exit) {
  const auto jobs = std::exchange(slots_.running, {});
  std::string ids;
  for (const auto& [id, job] : jobs) ids += (ids.empty() ? "" : " ") + id;
  log_(exit.planned_shutdown ? LogLevel::info : LogLevel::error, "worker_ended",
       {{"pid", std::to_string(exit.pid)}, {"reason", exit.reason}, {"job_ids", ids}});
  running_count_ = 0;
  ++notifications_;  // no owner is at its limit any more
  int interrupted = 0;
  for (const auto& [id, job] : jobs) {
    if (job.reported) continue;  // it may be the cause, but has ended
    ++interrupted;
    resolve_in_flight_job(job, decide(job.job, jobs.size(), exit.reason, exit.planned_shutdown, exit.code), exit);
  }
  return interrupted;
}

void JobDispatcher::resolve_in_flight_job(const RunningJob& running, const CrashDecision& decision,
                                          const WorkerExit& exit) {
  const queue::Job& job = running.job;
  const std::string detail = "The worker process " + exit.reason + ".";
  switch (decision.action) {
    case CrashDecision::Action::release:
      return release(job.id, running.fence, {.code = exit.code, .detail = detail});
    case CrashDecision::Action::release_as_suspect:
      return release(job.id, running.fence, {.suspect = true, .code = exit.code, .detail = detail});
    case CrashDecision::Action::count_attempt: {
      const auto pause = retry_pause(exit.code, job.attempt, job.max_attempts, settings_.retry);
      const std::int64_t pause_ms = pause.value_or(settings_.retry.pause_max).count();
      return release(job.id, running.fence,
                     {.counts = true, .suspect = true, .pause_ms = pause_ms, .code = exit.code, .detail = detail});
    }
    case CrashDecision::Action::fail:
      return outcomes_.fail(job.id, running.fence, decision.problem);
  }
}

void JobDispatcher::release(const std::string& id, std::int64_t fence, const queue::Release& release) {
  if (release.suspect) suspects_first_ = true;
  outcomes_.release(id, fence, release, [this] { ++notifications_; });
}

/// A job that ran out of memory runs alone in its next attempt.
void JobDispatcher::retry_or_fail(const RunningJob& running, const queue::Problem& problem) {
  const queue::Job& job = running.job;
  if (problem.code == assets_unavailable) {
    return release(job.id, running.fence,
                   {.pause_ms = settings_.retry.pause.count(), .code = problem.code, .detail = problem.detail});
  }
  const auto pause = retry_pause(problem.code, job.attempt, job.max_attempts, settings_.retry);
  if (!pause) return outcomes_.fail(job.id, running.fence, problem);
  log_(LogLevel::warning, "attempt_failed",
       {{"job_id", job.id},
        {"attempt", std::to_string(job.attempt)},
        {"code", problem.code},
        {"detail", problem.detail}});
  release(job.id, running.fence,
          {.counts = true,
           .suspect = problem.code == "out_of_memory",
           .pause_ms = pause->count(),
           .code = problem.code,
           .detail = problem.detail});
}

}  // namespace worker
