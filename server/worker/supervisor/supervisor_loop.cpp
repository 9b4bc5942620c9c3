#include "server/worker/supervisor/supervisor_loop.h"

#include <poll.h>

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

namespace worker {
namespace {

SupervisorSettings with_defaults(SupervisorSettings settings) {
  const int threads = settings.threads > 0 ? settings.threads : static_cast<int>(std::thread::hardware_concurrency());
  if (settings.slots <= 0) settings.slots = std::max(1, threads) + 1;
  if (settings.store_threads <= 0) settings.store_threads = std::max(16, settings.slots);
  return settings;
}

}  // namespace

Supervisor::Loop::Loop(queue::Queue& queue, SupervisorSettings settings, queue::Log log)
    : queue_(queue),
      settings_(with_defaults(std::move(settings))),
      log_(std::move(log)),
      restart_pause_(settings_.restart_pause),
      store_threads_(std::make_unique<StoreExecutor>(settings_.store_threads, settings_.store_pause, log_)),
      thread_([this] { run(); }) {}

Supervisor::Loop::~Loop() { drain(std::chrono::milliseconds(0)); }

void Supervisor::Loop::wake(bool for_suspects) noexcept {
  if (for_suspects) suspects_came_ = true;
  ++wakes_;
  events_.interrupt();
}

/// Two threads fewer stand between a submitter and the worker where the submitter claims.
void Supervisor::Loop::on_job_available() noexcept {
  const std::uint64_t wakes = ++wakes_;
  const std::uint64_t offered = offer_.exchange(no_offer);
  if (offered == no_offer) return events_.interrupt();
  ask({.wakes_seen = wakes, .took_last = wakes == offered + 1});
}

void Supervisor::Loop::cancel(const std::string& id) noexcept {
  events_.post([this, id] { cancel_job(id); });
}

void Supervisor::Loop::look(const std::string& id, std::uint32_t side) noexcept {
  events_.post([this, id, side] { forward_preview_request(id, side); });
}

void Supervisor::Loop::lost(const queue::Lease& lease) noexcept {
  events_.post([this, lease] { lose_job(lease); });
}

std::string Supervisor::Loop::not_ready() {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

std::string Supervisor::Loop::sandbox() {
  const std::lock_guard lock(status_mutex_);
  return sandbox_;
}

void Supervisor::Loop::say_status(std::string status) {
  const std::lock_guard lock(status_mutex_);
  status_ = draining_ ? "draining" : std::move(status);
}

bool Supervisor::Loop::drain(std::chrono::milliseconds patience) {
  const std::lock_guard lock(drain_mutex_);
  if (thread_.joinable()) {
    events_.post([this, patience] {
      draining_ = true;
      drain_deadline_ = Clock::now() + patience;
      say_status("draining");
    });
    thread_.join();
    store_threads_.reset();
  }
  return all_ended_;
}

// ---- the thread

void Supervisor::Loop::run() {
  for (;;) {
    const Time now = Clock::now();
    if (draining_) keep_draining(now);
    if (draining_ && idle() && life_ == Life::absent) return;
    if (life_ == Life::absent && !draining_ && now >= restart_at_) start_worker(now);
    keep_spare(now);
    claim_jobs(now);
    running_count_ = static_cast<int>(running_.size());
    offer_claim(now);
    wait(next_deadline());
    end_offer();
    for (const auto& call : events_.take()) call();
    if (life_ == Life::starting || life_ == Life::ready) read_worker();
    if (spare_ != nullptr) read_spare();
    keep_times(Clock::now());  // after reading: what waited in the socket while we slept counts as heard
  }
}

void Supervisor::Loop::wait(Time until) {
  // One whose socket is at its end is only waited for: it would wake us at once.
  const bool listens = worker_ != nullptr && life_ != Life::ending;
  const int unsent = listens && worker_->process.has_unsent() ? POLLOUT : 0;
  std::vector<pollfd> descriptors{
      {events_.descriptor(), POLLIN, 0},
      {listens ? worker_->process.socket() : -1, static_cast<short>(POLLIN | unsent), 0},
      {worker_ != nullptr ? worker_->process.pid_descriptor() : -1, POLLIN, 0},
      {spare_ != nullptr ? spare_->process.socket() : -1, POLLIN, 0},
      {worker_ != nullptr ? worker_->process.output().descriptor() : -1, POLLIN, 0},
      {spare_ != nullptr ? spare_->process.output().descriptor() : -1, POLLIN, 0},
  };
  const std::size_t others = descriptors.size();
  for (const auto& ended : ended_) descriptors.push_back({ended->process.pid_descriptor(), POLLIN, 0});
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  poll(descriptors.data(), descriptors.size(), static_cast<int>(std::clamp<decltype(left)>(left, 0, 60'000)));
  for (std::size_t i = ended_.size(); i-- > 0;) {
    if ((descriptors[others + i].revents & POLLIN) == 0) continue;
    log_spoken(ended_[i]->process);
    ended_.erase(ended_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (descriptors[4].revents != 0) log_spoken(worker_->process);
  if (descriptors[5].revents != 0) log_spoken(spare_->process);
  if ((descriptors[1].revents & POLLOUT) != 0) worker_->process.flush();
  if ((descriptors[2].revents & POLLIN) != 0) worker_ended();
}

Supervisor::Loop::Time Supervisor::Loop::next_deadline() const {
  Time next = Clock::now() + std::chrono::minutes(1);
  const auto consider = [&next](Time time) { next = std::min(next, time); };
  if (life_ == Life::absent && !draining_) consider(restart_at_);
  if (life_ == Life::starting) consider(worker_->started_at + settings_.start_timeout);
  if (life_ == Life::ready) consider(last_heard_ + settings_.heartbeat_timeout);
  if (life_ == Life::ready && spare_ == nullptr && !draining_) consider(spare_at_);
  if (claims_paused_until_ > Clock::now()) consider(claims_paused_until_);
  if (draining_ && !gave_up_) consider(drain_deadline_);
  for (const auto& [id, job] : running_) {
    if (job.answer_at) consider(*job.answer_at);
    if (job.answered && job.replace_at > Clock::now()) consider(job.replace_at);
    if (job.stop_at && life_ == Life::ready) consider(*job.stop_at);
    if (job.kill_at && life_ == Life::ready) consider(*job.kill_at);
  }
  return next;
}

void Supervisor::Loop::keep_times(Time now) {
  for (auto& [id, job] : running_) {
    if (job.stop_at && now >= *job.stop_at) {
      job.stop_at.reset();
      if (!job.cancel_requested) job.stopped_for = job.overdue;
      stop(id, job);
    }
    if (job.answer_at && now >= *job.answer_at) {
      job.answer_at.reset();
      job.answered = true;
      answer_stopped(id, job);
    }
  }
  if (life_ == Life::starting && now >= worker_->started_at + settings_.start_timeout) {
    end_worker("was not ready within the start timeout", false);
  }
  if (life_ == Life::ready && now >= last_heard_ + settings_.heartbeat_timeout) {
    end_worker("gave no sign of life", false);
  }
  const bool disobeyed = std::any_of(running_.begin(), running_.end(), [&](const auto& entry) {
    return entry.second.kill_at && now >= *entry.second.kill_at;
  });
  if (life_ == Life::ready && (disobeyed || may_be_replaced(now))) end_worker("did not stop a job", true);
}

void Supervisor::Loop::keep_draining(Time now) {
  if (now >= drain_deadline_ && !gave_up_) {
    gave_up_ = true;
    store_threads_->give_up();
  }
  const bool wanted = !running_.empty() && !gave_up_;
  if (!wanted && life_ != Life::absent && life_ != Life::ending) end_worker("was stopped by drain", true);
}

}  // namespace worker
