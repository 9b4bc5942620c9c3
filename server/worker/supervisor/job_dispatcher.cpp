/// Jobs on their way from the queue into the worker and back.

#include <algorithm>
#include <cctype>
#include <exception>
#include <utility>

#include "server/worker/supervisor/supervisor_loop.h"

namespace worker {

using queue::LogLevel;

namespace {

/// What a worker may call an image: it becomes part of an address and of a header.
bool is_plain(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || c == '+' || c == '/';
  });
}

std::string for_the_owner(const queue::StoreFailure& failure) {
  const bool full = failure.kind == queue::StoreFailure::Kind::full;
  return std::string("The image was made but could not be stored: ") +
         (full ? "the disk is full." : "the store is not available.");
}

}  // namespace

// ---- into the worker

void Supervisor::Loop::claim_jobs(Time now) {
  if (life_ != Life::ready || draining_ || now < claims_paused_until_) return;
  if (suspects_came_.exchange(false)) suspects_first_ = true;
  if (suspects_first_) {
    if (idle()) claim(ClaimOf::suspect);
    return;
  }
  while (found_nothing_ != wakes_ && place_for(ClaimOf::any)) claim(ClaimOf::any);
  while (found_nothing_small_ != wakes_ && place_for(ClaimOf::small)) claim(ClaimOf::small);
}

bool Supervisor::Loop::place_for(ClaimOf of) const {
  const auto slots = static_cast<std::size_t>(settings_.slots);
  // As many claims at once as the last ones found jobs: one job that comes alone is not searched for by all places.
  if (claiming_ >= std::max<std::size_t>(1, found_in_a_row_)) return false;
  // Finished images wait in memory for the store: when it is slower than the worker, the worker waits.
  const std::size_t storing_limit = slots + static_cast<std::size_t>(settings_.store_threads);
  if (running_.size() + claiming_ >= slots || storing_ >= storing_limit) return false;
  if (of == ClaimOf::small || slots == 1) return true;
  const auto large =
      std::count_if(running_.begin(), running_.end(), [](const auto& entry) { return entry.second.large; });
  return static_cast<std::size_t>(large) + claiming_any_ < slots - 1;
}

void Supervisor::Loop::claim(ClaimOf of) {
  ++claiming_;
  if (of == ClaimOf::any) ++claiming_any_;
  store_threads_->run([this, of, wakes_seen = wakes_.load()] { ask({.of = of, .wakes_seen = wakes_seen}); });
}

/// Any thread, on behalf of a claim that is counted or offered.
void Supervisor::Loop::ask(Claimed result) noexcept {
  try {
    result.claim = queue_.lifecycle.claim(result.of == ClaimOf::suspect);
    if (result.claim) {
      const queue::Job& job = result.claim->job;
      const auto queue_ms = static_cast<double>(std::max<std::int64_t>(*job.started_at - job.created_at, 0));
      result.assignment = pack(Assign{job.id, result.claim->fence, queue_ms, std::exchange(result.claim->document, {}),
                                      queue::name_of(job.kind), job.large});
    }
  } catch (const std::exception& failure) {
    result.failed = true;
    log_(LogLevel::error, "store_failure", {{"during", "claim"}, {"detail", failure.what()}});
  }
  events_.post([this, shared = std::make_shared<Claimed>(std::move(result))] { claimed(shared); });
}

/// One claim to whoever submits the next job, while nothing waits.
void Supervisor::Loop::offer_claim(Time now) {
  const bool nothing_waits = found_nothing_ && found_nothing_ == found_nothing_small_ && found_nothing_ == wakes_;
  const bool may_claim = life_ == Life::ready && !draining_ && now >= claims_paused_until_ && !suspects_first_;
  offered_ = nothing_waits && may_claim && claiming_ == 0 && place_for(ClaimOf::any);
  if (offered_) offer_ = *found_nothing_;
}

void Supervisor::Loop::end_offer() {
  if (!std::exchange(offered_, false) || offer_.exchange(no_offer) != no_offer) return;
  ++claiming_;  // it was taken
  ++claiming_any_;
}

void Supervisor::Loop::claimed(const std::shared_ptr<Claimed>& result) {
  --claiming_;
  if (result->of == ClaimOf::any) --claiming_any_;
  if (result->failed) claims_paused_until_ = Clock::now() + settings_.store_pause;
  if (!result->failed) found_in_a_row_ = result->claim && !result->took_last ? found_in_a_row_ + 1 : 0;
  if (result->claim && result->took_last) found_nothing_ = found_nothing_small_ = result->wakes_seen;
  if (result->claim) {
    const queue::Job& job = result->claim->job;
    const std::int64_t fence = result->claim->fence;
    if (early_cancels_.erase(job.id) > 0) {
      finish_cancel(job.id, fence);
    } else if (result->failed || draining_ || life_ != Life::ready) {
      give_back(job.id, fence, false, job.suspect, {});
    } else if (running_.contains(job.id)) {
      // Its owner wants it again, but the worker has not stopped it yet.
      give_back(job.id, fence, false, job.suspect, settings_.retry.pause);
    } else {
      running_.emplace(job.id, running_job(*result->claim));
      worker_->process.send(std::move(result->assignment));
      log_(LogLevel::debug, "job_assigned", {{"job_id", job.id}, {"attempt", std::to_string(job.attempt)}});
    }
  } else if (!result->failed) {
    if (result->of == ClaimOf::suspect) suspects_first_ = false;
    if (result->of == ClaimOf::any) found_nothing_ = result->wakes_seen;
    if (result->of != ClaimOf::suspect) found_nothing_small_ = result->wakes_seen;
  }
  if (claiming_ == 0) early_cancels_.clear();
}

Supervisor::Loop::Running Supervisor::Loop::running_job(const queue::Claim& claim) const {
  const queue::Job& job = claim.job;
  Running running;
  running.fence = claim.fence;
  running.attempt = job.attempt;
  running.max_attempts = job.max_attempts;
  running.large = job.large;
  const std::string limit_s = std::to_string(std::chrono::duration<double>(settings_.wall_time).count());
  running.stop_at = Clock::now() + settings_.wall_time;
  running.overdue = {"timed_out", "An attempt took longer than the limit wall_time_s of " + limit_s + " s.", {}};
  if (job.deadline) {
    const auto until_deadline = std::chrono::milliseconds(*job.deadline - *job.started_at);
    if (until_deadline < settings_.wall_time) {
      running.stop_at = Clock::now() + until_deadline;
      running.overdue = queue::deadline_exceeded();
    }
  }
  return running;
}

void Supervisor::Loop::cancel_job(const std::string& id) {
  const auto found = running_.find(id);
  if (found == running_.end()) {
    if (claiming_ > 0) early_cancels_.insert(id);
    return;
  }
  Running& job = found->second;
  if (job.cancel_requested) return;
  job.cancel_requested = true;
  stop(id, job);
}

void Supervisor::Loop::lose_job(const queue::Lease& lease) {
  const auto found = running_.find(lease.job_id);
  if (found == running_.end() || found->second.fence != lease.fence) return;
  log_(LogLevel::warning, "lease_lost", {{"job_id", lease.job_id}});
  found->second.lost = true;
  stop(lease.job_id, found->second);
}

void Supervisor::Loop::stop(const std::string& id, Running& job) {
  job.answer_at = Clock::now() + settings_.cancel_answer;
  if (job.kill_at) return;  // it has been told
  job.replace_at = Clock::now() + settings_.cancel_replace;
  job.kill_at = Clock::now() + settings_.cancel_grace;
  if (life_ == Life::ready) worker_->process.send(pack(Cancel{id}));
}

void Supervisor::Loop::answer_stopped(const std::string& id, const Running& job) {
  if (job.lost) return;
  if (job.cancel_requested) return finish_cancel(id, job.fence);
  attempt_failed(id, job, *job.stopped_for);
}

// ---- out of the worker

/// False for what is no longer the worker's: it was given back or is not known at all.
bool Supervisor::Loop::take(const std::string& id, std::int64_t fence, Running& job) {
  const auto found = running_.find(id);
  if (found == running_.end() || found->second.fence != fence) {
    log_(LogLevel::warning, "stale_result", {{"job_id", id}});
    return false;
  }
  job = found->second;
  running_.erase(found);
  restart_pause_ = settings_.restart_pause;  // it works
  return true;
}

void Supervisor::Loop::on_message(Progress& message) {
  if (message.tiles_total == 0 || !running_.contains(message.job_id)) return;
  queue_.lifecycle.set_progress(message.job_id,
                                static_cast<double>(message.tiles_done) / static_cast<double>(message.tiles_total));
}

void Supervisor::Loop::forward_preview_request(const std::string& id, std::uint32_t side) {
  if (life_ == Life::ready && running_.contains(id)) worker_->process.send(pack(Look{id, side}));
}

void Supervisor::Loop::on_message(Looked& message) {
  if (running_.contains(message.job_id))
    queue_.waiters.add_preview(message.job_id, message.side, std::move(message.png));
}

void Supervisor::Loop::on_message(Finished& message) {
  for (const Image& image : message.images) {
    if (!is_plain(image.name) || !is_plain(image.media_type)) {
      return end_worker("sent an image with an unlikely name", false);
    }
  }
  Running job;
  if (!take(message.job_id, message.fence, job)) return;
  store([this, job, finished = std::make_shared<Finished>(std::move(message))] {
    std::vector<queue::JobLifecycle::Image> images;
    for (const Image& image : finished->images) {
      images.push_back({image.name, image.media_type, image.bytes.get()});
    }
    const std::string& id = finished->job_id;
    const std::int64_t fence = finished->fence;
    const auto failure = store_threads_->run_with_retry(settings_.store_tries, "succeed", [&] {
      log_end("job_succeeded", id, queue_.lifecycle.succeed(id, fence, finished->report, images));
    });
    // After a broken disk the next start finds the job running, and gives it back at no cost.
    if (!failure || failure->kind == queue::StoreFailure::Kind::broken) return;
    const queue::Problem problem{"storage_failure", for_the_owner(*failure), {}};
    events_.post([this, id, job, problem] { attempt_failed(id, job, problem); });
  });
}

void Supervisor::Loop::on_message(Failed& message) {
  Running job;
  if (take(message.job_id, message.fence, job)) attempt_failed(message.job_id, job, message.problem);
}

void Supervisor::Loop::on_message(Cancelled& message) {
  Running job;
  if (!take(message.job_id, message.fence, job)) return;
  if (job.cancel_requested || job.stopped_for || job.lost) return answer_stopped(message.job_id, job);
  attempt_failed(message.job_id, job, {"internal", "The worker stopped the job without being asked to.", {}});
}

void Supervisor::Loop::update_variances(const std::vector<InFlightJob>& casualties,
                                        const std::vector<CrashDecision>& verdicts, const std::string& code) {
  for (std::size_t i = 0; i < casualties.size(); ++i) {
    const auto& [id, fence, attempt, max_attempts, cancel_requested, answered] = casualties[i];
    if (answered) continue;
    switch (verdicts[i].action) {
      case CrashDecision::Action::give_back:
        give_back(id, fence, false, false, {});
        break;
      case CrashDecision::Action::give_back_suspect:
        give_back(id, fence, false, true, {});
        break;
      case CrashDecision::Action::count_attempt:
        give_back(id, fence, true, true,
                  retry_pause(code, attempt, max_attempts, settings_.retry).value_or(settings_.retry.pause_max));
        break;
      case CrashDecision::Action::fail:
        fail(id, fence, verdicts[i].problem);
        break;
    }
  }
}

// ---- to the store

void Supervisor::Loop::store(std::function<void()> task) {
  ++storing_;
  store_threads_->run([this, task = std::move(task)] {
    task();
    events_.post([this] { --storing_; });
  });
}

void Supervisor::Loop::give_back(const std::string& id, std::int64_t fence, bool counts, bool suspect,
                                 std::chrono::milliseconds pause) {
  if (suspect) suspects_first_ = true;
  store([this, id, fence, counts, suspect, pause] {
    store_threads_->run_with_retry(0, "release", [&] {
      log_end("job_given_back", id, queue_.lifecycle.release(id, fence, counts, suspect, pause.count()));
    });
    ++wakes_;
  });
}

/// Another attempt where that may help; one that was short of memory then runs alone.
void Supervisor::Loop::attempt_failed(const std::string& id, const Running& job, const queue::Problem& problem) {
  const auto pause = retry_pause(problem.code, job.attempt, job.max_attempts, settings_.retry);
  if (!pause) return fail(id, job.fence, problem);
  log_(LogLevel::warning, "attempt_failed",
       {{"job_id", id}, {"attempt", std::to_string(job.attempt)}, {"code", problem.code}, {"detail", problem.detail}});
  give_back(id, job.fence, true, problem.code == "out_of_memory", *pause);
}

void Supervisor::Loop::finish_cancel(const std::string& id, std::int64_t fence) {
  store([this, id, fence] {
    store_threads_->run_with_retry(0, "cancel",
                                   [&] { log_end("job_cancelled", id, queue_.lifecycle.finish_cancel(id, fence)); });
  });
}

void Supervisor::Loop::fail(const std::string& id, std::int64_t fence, const queue::Problem& problem) {
  store([this, id, fence, problem] {
    store_threads_->run_with_retry(0, "fail", [&] {
      log_end("job_failed", id, queue_.lifecycle.fail(id, fence, problem), {{"code", problem.code}});
    });
  });
}

/// `moved` is false where another one was first: a cancel that was told before the worker answered.
void Supervisor::Loop::log_end(const char* event, const std::string& id, bool moved, queue::LogFields more) {
  if (!moved) return;
  more.emplace_back("job_id", id);
  log_(LogLevel::info, event, more);
}

}  // namespace worker
