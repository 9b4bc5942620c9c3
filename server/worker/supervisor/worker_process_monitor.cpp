/// The worker's life: started, heard, ended, mourned.

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <utility>

#include "server/worker/supervisor/supervisor_loop.h"

namespace worker {

using queue::LogLevel;

namespace {

/// 0 where it cannot be told: the process is gone.
std::uint64_t resident_bytes(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t size_pages = 0, resident_pages = 0;
  file >> size_pages >> resident_pages;
  return resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::unique_ptr<Supervisor::Loop::Worker> Supervisor::Loop::new_worker() {
  return std::make_unique<Worker>(
      settings_.executable,
      Options{settings_.slots, settings_.threads, settings_.job_memory_bytes, settings_.scene_cache_bytes,
              static_cast<std::uint64_t>(settings_.cache_idle.count()), settings_.files});
}

void Supervisor::Loop::start_worker(Time now) {
  try {
    worker_ = spare_ != nullptr ? std::move(spare_) : new_worker();
  } catch (const std::exception& failure) {
    log_(LogLevel::error, "worker_not_started", {{"detail", failure.what()}});
    say_status(std::string("worker: ") + failure.what());
    restart_at_ = now + settings_.restart_pause_max;
    return;
  }
  life_ = Life::starting;
  last_heard_ = now;
  pid_ = worker_->process.pid();
  log_(LogLevel::info, "worker_started", {{"pid", std::to_string(pid_)}, {"slots", std::to_string(settings_.slots)}});
  if (worker_->hello) on_worker_ready();
}

void Supervisor::Loop::on_message(Hello& message) {
  worker_->hello = std::move(message);
  if (life_ == Life::starting) on_worker_ready();
}

void Supervisor::Loop::on_worker_ready() {
  life_ = Life::ready;
  idle_memory_bytes_ = resident_bytes(pid_);
  say_status("");
  {
    const std::lock_guard lock(status_mutex_);
    sandbox_ = worker_->hello->sandbox;
  }
  const auto start_ms = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - worker_->started_at);
  log_(LogLevel::info, "worker_ready",
       {{"pid", std::to_string(pid_)},
        {"build", worker_->hello->build},
        {"sandbox", worker_->hello->sandbox},
        {"start_ms", std::to_string(start_ms.count())}});
}

// ---- the next one

/// Once there is one that works: a program that cannot start at all is not started twice.
void Supervisor::Loop::keep_spare(Time now) {
  if (draining_) return spare_.reset();
  if (life_ != Life::ready || spare_ != nullptr || now < spare_at_) return;
  try {
    spare_ = new_worker();
  } catch (const std::exception& failure) {
    log_(LogLevel::warning, "spare_not_started", {{"detail", failure.what()}});
    spare_at_ = now + settings_.restart_pause_max;
  }
}

/// It only tells that it is ready and alive. One that dies, of a lack of memory, is not missed soon.
void Supervisor::Loop::read_spare() {
  for (;;) {
    Received received = spare_->process.receive();
    if (std::holds_alternative<Nothing>(received)) return;
    auto* message = std::get_if<Message>(&received);
    auto* hello = message == nullptr ? nullptr : std::get_if<Hello>(message);
    if (hello != nullptr) spare_->hello = std::move(*hello);
    if (message != nullptr && (hello != nullptr || std::holds_alternative<Heartbeat>(*message))) continue;
    log_spoken(spare_->process);
    log_(LogLevel::warning, "spare_ended", {{"pid", std::to_string(spare_->process.pid())}});
    spare_.reset();
    spare_at_ = Clock::now() + settings_.restart_pause_max;
    return;
  }
}

// ---- heard, ended, mourned

void Supervisor::Loop::on_message(Heartbeat& message) {
  kept_geometry_bytes_ = message.geometry_bytes;
  kept_image_bytes_ = message.image_bytes;
  watch_memory();
}

void Supervisor::Loop::watch_memory() {
  if (running_.empty() || life_ != Life::ready) return;
  const std::uint64_t kept = kept_geometry_bytes_ + kept_image_bytes_;
  const std::uint64_t limit =
      idle_memory_bytes_ + std::min(kept, settings_.scene_cache_bytes) + running_.size() * settings_.job_memory_bytes;
  const std::uint64_t seen = resident_bytes(pid_);
  if (seen <= limit) return;
  end_worker("had " + std::to_string(seen) + " bytes of memory, above the limit job_memory_bytes of " +
                 std::to_string(settings_.job_memory_bytes) + " for each job,",
             false, "out_of_memory");
}

void Supervisor::Loop::read_worker() {
  // A flood must not keep us from the rest; what is left is read in the next round.
  for (int messages = 0; messages < 256 && (life_ == Life::starting || life_ == Life::ready); ++messages) {
    Received received = worker_->process.receive();
    if (std::holds_alternative<Nothing>(received)) return;
    last_heard_ = Clock::now();
    if (auto* message = std::get_if<Message>(&received)) std::visit([this](auto& kind) { on_message(kind); }, *message);
    if (auto* malformed = std::get_if<Malformed>(&received)) end_worker("sent " + malformed->detail, false);
    if (std::holds_alternative<Lost>(received)) end_worker("sent what this process had no descriptors for", true);
    if (std::holds_alternative<Closed>(received)) {
      life_ = Life::ending;  // its process tells how; who has no socket any more is past changing that
      worker_->process.kill();
    }
  }
}

/// Killed, and gone as far as jobs are concerned: the next one need not wait for the system to take gigabytes back.
void Supervisor::Loop::end_worker(const std::string& why, bool planned_shutdown, const char* code) {
  worker_->process.kill();
  ended_.push_back(std::move(worker_));
  on_worker_exit(why, planned_shutdown, code);
}

void Supervisor::Loop::worker_ended() {
  // What it said before it died still counts.
  while (life_ == Life::starting || life_ == Life::ready) {
    const Time heard_before = last_heard_;
    read_worker();
    if (last_heard_ == heard_before) break;
  }
  if (worker_ == nullptr) return;  // its last words were none of ours
  log_spoken(worker_->process);
  const std::string how = worker_->process.reap();
  worker_.reset();
  on_worker_exit(how, false, "worker_crashed");
}

void Supervisor::Loop::on_worker_exit(const std::string& how, bool planned_shutdown, const char* code) {
  log_(planned_shutdown ? LogLevel::info : LogLevel::error, "worker_ended",
       {{"pid", std::to_string(pid_)}, {"how", how}, {"job_ids", list_of_jobs()}});

  std::vector<InFlightJob> casualties;
  for (const auto& [id, job] : running_) {
    casualties.push_back({id, job.fence, job.attempt, job.max_attempts, job.cancel_requested, job.answered});
    if (draining_ && !job.answered) all_ended_ = false;
  }
  running_.clear();
  update_variances(casualties, decide(casualties, how, planned_shutdown, code), code);

  pid_ = 0;
  kept_geometry_bytes_ = kept_image_bytes_ = 0;
  life_ = Life::absent;
  say_status("worker: restarting");
  restart_at_ = Clock::now();
  if (planned_shutdown) return;
  restart_at_ += restart_pause_;
  restart_pause_ = std::min(2 * restart_pause_, settings_.restart_pause_max);
}

/// What is not said in messages is nothing we know: libraries' words, mostly.
void Supervisor::Loop::log_spoken(Process& process) {
  process.output().read(Clock::now(), [&](const std::string& text, std::uint64_t left_out) {
    queue::LogFields fields{{"worker", std::to_string(process.pid())}, {"text", text}};
    if (left_out > 0) fields.emplace_back("left_out", std::to_string(left_out));
    log_(LogLevel::warning, "worker_output", fields);
  });
}

/// When it has nothing but jobs that it has not stopped. Without a spare one the start of the next would take longer
/// than to wait for it.
bool Supervisor::Loop::may_be_replaced(Time now) const {
  if (running_.empty() || spare_ == nullptr || !spare_->hello) return false;
  return std::all_of(running_.begin(), running_.end(),
                     [now](const auto& entry) { return entry.second.answered && now >= entry.second.replace_at; });
}

std::string Supervisor::Loop::list_of_jobs() const {
  std::string list;
  for (const auto& [id, job] : running_) list += (list.empty() ? "" : " ") + id;
  return list;
}

}  // namespace worker
