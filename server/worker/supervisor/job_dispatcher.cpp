#include "server/worker/supervisor/job_dispatcher.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <utility>
#include <vector>

namespace worker {

using queue::LogLevel;

namespace {

/// Image names of the worker become part of URLs and HTTP headers.
bool is_valid_name(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || c == '+' || c == '/';
  });
}

}  // namespace

// ---- claims

void JobDispatcher::on_jobs_available(bool suspects) noexcept {
  if (suspects) suspects_available_ = true;
  ++notifications_;
}

void JobDispatcher::claim_jobs(Time now) {
  if (process_.state() != WorkerState::ready || deadlines_.draining() || now < claims_paused_until_) return;
  if (suspects_available_.exchange(false)) suspects_first_ = true;
  if (suspects_first_) {
    if (idle()) start_claim(ClaimKind::suspect);
    return;
  }
  while (claims_.none_left != notifications_ && has_slot(ClaimKind::any)) start_claim(ClaimKind::any);
  while (claims_.none_left_small != notifications_ && has_slot(ClaimKind::small)) start_claim(ClaimKind::small);
}

JobDispatcher::Time JobDispatcher::next_claim(Time now) const {
  return claims_paused_until_ > now ? claims_paused_until_ : Time::max();
}

/// One slot is never given to a large job, so that small images need not wait for the end of large ones.
bool JobDispatcher::has_slot(ClaimKind kind) const {
  const auto slots = static_cast<std::size_t>(settings_.slots);
  // One claim at a time until one leaves jobs behind: a single job does not occupy all threads.
  if (claims_.count > 0 && !claims_.more_wait) return false;
  // Finished images wait in memory for the store; the limit makes the worker wait for a slow store.
  const std::size_t pending_max = slots + static_cast<std::size_t>(settings_.store_threads);
  if (running_.size() + claims_.count >= slots || outcomes_.pending() >= pending_max) return false;
  if (kind == ClaimKind::small || slots == 1) return true;
  const auto large =
      std::count_if(running_.begin(), running_.end(), [](const auto& entry) { return entry.second.large; });
  return static_cast<std::size_t>(large) + claims_.large_count < slots - 1;
}

void JobDispatcher::start_claim(ClaimKind kind) {
  ++claims_.count;
  if (kind == ClaimKind::any) ++claims_.large_count;
  executor_.run([this, kind, notifications = notifications_.load()] {
    run_claim({.kind = kind, .notifications = notifications});
  });
}

/// Any thread.
void JobDispatcher::run_claim(ClaimResult result) noexcept {
  try {
    result.claim = queue_.lifecycle.claim(result.kind == ClaimKind::suspect, result.kind == ClaimKind::small);
  } catch (const std::exception& failure) {
    result.failed = true;
    log_(LogLevel::error, "store_failure", {{"during", "claim"}, {"detail", failure.what()}});
  }
  post_claim(std::move(result));
}

void JobDispatcher::return_slot(std::optional<queue::Claim>&& claim) noexcept {
  post_claim({.kind = ClaimKind::submitted, .claim = std::move(claim)});
}

/// Any thread.
void JobDispatcher::post_claim(ClaimResult result) noexcept {
  try {
    if (result.claim) {
      const queue::Job& job = result.claim->job;
      const auto queue_ms = static_cast<double>(std::max<std::int64_t>(*job.started_at - job.created_at, 0));
      result.assignment = pack(Assign{job.id, result.claim->fence, queue_ms, std::exchange(result.claim->document, {}),
                                      queue::name_of(job.kind), job.large});
    }
  } catch (const std::exception& failure) {
    result.failed = true;
    log_(LogLevel::error, "job_not_assigned", {{"detail", failure.what()}});
  }
  events_.post([this, shared = std::make_shared<ClaimResult>(std::move(result))] { on_claimed(*shared); });
}

void JobDispatcher::offer_slot(Time now) {
  const bool none_wait = claims_.none_left == notifications_ && claims_.none_left_small == notifications_;
  const bool may_claim = process_.state() == WorkerState::ready && !deadlines_.draining() &&
                         now >= claims_paused_until_ && !suspects_first_ && !suspects_available_;
  offering_slot_ = none_wait && may_claim && claims_.count == 0 && has_slot(ClaimKind::any);
  slot_offered_ = offering_slot_;
}

void JobDispatcher::withdraw_slot() {
  if (!std::exchange(offering_slot_, false) || slot_offered_.exchange(false)) return;
  ++claims_.count;  // a submission has taken it
  ++claims_.large_count;
}

void JobDispatcher::on_claimed(ClaimResult& result) {
  --claims_.count;
  if (result.kind == ClaimKind::any || result.kind == ClaimKind::submitted) --claims_.large_count;
  const bool none_left = !result.claim || result.claim->is_last;
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
    } else if (result.failed || deadlines_.draining() || process_.state() != WorkerState::ready) {
      release(job.id, fence, false, job.suspect, {});
    } else if (running_.contains(job.id)) {  // it was retried before the worker has stopped its previous attempt
      release(job.id, fence, false, job.suspect, settings_.retry.pause);
    } else {
      start_job(result);
    }
  } else if (!result.failed && result.kind == ClaimKind::suspect) {
    suspects_first_ = false;
  }
  if (none_left && !result.failed) {
    if (result.kind == ClaimKind::any) claims_.none_left = result.notifications;
    if (result.kind == ClaimKind::any || result.kind == ClaimKind::small)
      claims_.none_left_small = result.notifications;
  }
  if (claims_.count == 0) early_cancels_.clear();
}

void JobDispatcher::start_job(ClaimResult& result) {
  const queue::Job& job = result.claim->job;
  RunningJob running;
  running.large = job.large;
  running.fence = result.claim->fence;
  running.attempt = job.attempt;
  running.max_attempts = job.max_attempts;
  running_.emplace(job.id, running);
  running_count_ = static_cast<int>(running_.size());
  deadlines_.add(job, Time::clock::now());
  process_.send(std::move(result.assignment));
  log_(LogLevel::debug, "job_assigned", {{"job_id", job.id}, {"attempt", std::to_string(job.attempt)}});
}

// ---- running jobs

void JobDispatcher::cancel(const std::string& id) {
  const auto found = running_.find(id);
  if (found == running_.end()) {
    if (claims_.count > 0) early_cancels_.insert(id);
    return;
  }
  if (std::exchange(found->second.cancel_requested, true)) return;
  stop(id);
}

void JobDispatcher::on_lease_lost(const queue::Lease& lease) {
  const auto found = running_.find(lease.job_id);
  if (found == running_.end() || found->second.fence != lease.fence) return;
  log_(LogLevel::warning, "lease_lost", {{"job_id", lease.job_id}});
  found->second.lease_lost = true;
  ++notifications_;  // the job may be queued again
  stop(lease.job_id);
}

void JobDispatcher::stop(const std::string& id) {
  if (deadlines_.stop(id, Time::clock::now())) process_.send(pack(Cancel{id}));
}

void JobDispatcher::check_deadlines(Time now) {
  for (const Deadlines::Overdue& overdue : deadlines_.take_overdue(now)) {
    RunningJob& job = running_.at(overdue.job_id);
    if (!job.cancel_requested) job.stopped_for = overdue.problem;
    stop(overdue.job_id);
  }
  for (const std::string& id : deadlines_.take_reportable(now)) report_stopped(id, running_.at(id));
  if (process_.state() == WorkerState::ready && deadlines_.worker_must_end(now, process_.standby_ready())) {
    process_.end("did not stop a job", true);
  }
}

void JobDispatcher::report_stopped(const std::string& id, const RunningJob& job) {
  if (job.lease_lost) return;
  if (job.cancel_requested) return outcomes_.cancel(id, job.fence);
  retry_or_fail(id, job, *job.stopped_for);
}

void JobDispatcher::request_preview(const std::string& id, std::uint32_t side) {
  if (running_.contains(id)) process_.send(pack(PreviewRequest{id, side}));
}

// ---- messages of the worker

void JobDispatcher::on_message(Message& message) {
  if (const auto* progress = std::get_if<Progress>(&message)) {
    if (progress->tiles_total == 0 || !running_.contains(progress->job_id)) return;
    queue_.lifecycle.set_progress(
        progress->job_id, static_cast<double>(progress->tiles_done) / static_cast<double>(progress->tiles_total));
  } else if (auto* preview = std::get_if<PreviewResponse>(&message)) {
    if (running_.contains(preview->job_id))
      queue_.waiters.add_preview(preview->job_id, preview->side, std::move(preview->png));
  } else if (auto* finished = std::get_if<Finished>(&message)) {
    on_finished(*finished);
  } else if (const auto* failed = std::get_if<Failed>(&message)) {
    if (const auto job = take(failed->job_id, failed->fence)) retry_or_fail(failed->job_id, *job, failed->problem);
  } else if (const auto* cancelled = std::get_if<Cancelled>(&message)) {
    on_cancelled(*cancelled);
  }
}

/// None if the job does not run in the worker any more.
std::optional<JobDispatcher::RunningJob> JobDispatcher::take(const std::string& id, std::int64_t fence) {
  const auto found = running_.find(id);
  if (found == running_.end() || found->second.fence != fence) {
    log_(LogLevel::warning, "stale_result", {{"job_id", id}});
    return std::nullopt;
  }
  RunningJob job = std::move(found->second);
  running_.erase(found);
  running_count_ = static_cast<int>(running_.size());
  deadlines_.remove(id);
  process_.reset_restart_pause();
  return job;
}

void JobDispatcher::on_finished(Finished& message) {
  const bool valid = std::all_of(message.images.begin(), message.images.end(), [](const Image& image) {
    return is_valid_name(image.name) && is_valid_name(image.media_type);
  });
  if (!valid) return process_.end("sent a result with an invalid image name", false);
  const auto job = take(message.job_id, message.fence);
  if (!job) return;
  const auto on_failure = [this, id = message.job_id, job = *job](const queue::Problem& problem) {
    retry_or_fail(id, job, problem);
  };
  outcomes_.succeed(std::move(message), on_failure);
}

void JobDispatcher::on_cancelled(const Cancelled& message) {
  const auto job = take(message.job_id, message.fence);
  if (!job) return;
  if (job->cancel_requested || job->stopped_for || job->lease_lost) return report_stopped(message.job_id, *job);
  retry_or_fail(message.job_id, *job, {"internal", "The worker stopped the job without a request.", {}});
}

int JobDispatcher::on_worker_exit(const WorkerExit& exit) {
  std::vector<InFlightJob> jobs;
  std::string ids;
  for (const auto& [id, job] : running_) {
    jobs.push_back({id, job.fence, job.attempt, job.max_attempts, job.cancel_requested, deadlines_.is_reported(id)});
    ids += (ids.empty() ? "" : " ") + id;
  }
  log_(exit.planned_shutdown ? LogLevel::info : LogLevel::error, "worker_ended",
       {{"pid", std::to_string(exit.pid)}, {"reason", exit.reason}, {"job_ids", ids}});
  running_.clear();
  running_count_ = 0;
  deadlines_.clear();
  const auto decisions = decide(jobs, exit.reason, exit.planned_shutdown, exit.code);
  int interrupted = 0;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (jobs[i].reported) continue;
    ++interrupted;
    resolve_in_flight_job(jobs[i], decisions[i], exit.code);
  }
  return interrupted;
}

void JobDispatcher::resolve_in_flight_job(const InFlightJob& job, const CrashDecision& decision,
                                          const std::string& code) {
  switch (decision.action) {
    case CrashDecision::Action::release:
      return release(job.job_id, job.fence, false, false, {});
    case CrashDecision::Action::release_as_suspect:
      return release(job.job_id, job.fence, false, true, {});
    case CrashDecision::Action::count_attempt: {
      const auto pause = retry_pause(code, job.attempt, job.max_attempts, settings_.retry);
      return release(job.job_id, job.fence, true, true, pause.value_or(settings_.retry.pause_max));
    }
    case CrashDecision::Action::fail:
      return outcomes_.fail(job.job_id, job.fence, decision.problem);
  }
}

void JobDispatcher::release(const std::string& id, std::int64_t fence, bool counts, bool suspect,
                            std::chrono::milliseconds pause) {
  if (suspect) suspects_first_ = true;
  outcomes_.release(id, fence, counts, suspect, pause, [this] { ++notifications_; });
}

/// A job that ran out of memory runs alone in its next attempt.
void JobDispatcher::retry_or_fail(const std::string& id, const RunningJob& job, const queue::Problem& problem) {
  const auto pause = retry_pause(problem.code, job.attempt, job.max_attempts, settings_.retry);
  if (!pause) return outcomes_.fail(id, job.fence, problem);
  log_(LogLevel::warning, "attempt_failed",
       {{"job_id", id}, {"attempt", std::to_string(job.attempt)}, {"code", problem.code}, {"detail", problem.detail}});
  release(id, job.fence, true, problem.code == "out_of_memory", *pause);
}

}  // namespace worker
