/// The worker's life: started, heard, ended, mourned.

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <utility>

#include "server/worker/supervisor_loop.h"

namespace worker {

using jobs::LogLevel;

namespace {

/// 0 where it cannot be told: the process is gone.
std::uint64_t resident_bytes(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t size_pages = 0, resident_pages = 0;
  file >> size_pages >> resident_pages;
  return resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

void Supervisor::Loop::start_worker(Time now) {
  try {
    process_ = std::make_unique<Process>(
        settings_.executable,
        arguments_of({settings_.slots, settings_.threads, settings_.job_memory_bytes, settings_.scene_cache_bytes,
                      static_cast<std::uint64_t>(settings_.cache_idle.count()), settings_.files}));
  } catch (const std::exception& failure) {
    log_(LogLevel::error, "worker_not_started", {{"detail", failure.what()}});
    say_status(std::string("worker: ") + failure.what());
    restart_at_ = now + settings_.restart_pause_max;
    return;
  }
  life_ = Life::starting;
  started_at_ = last_heard_ = now;
  end_reason_.clear();
  end_code_ = "worker_crashed";
  end_excused_ = false;
  pid_ = process_->pid();
  log_(LogLevel::info, "worker_started", {{"pid", std::to_string(pid_)}, {"slots", std::to_string(settings_.slots)}});
}

void Supervisor::Loop::hear(Hello& message) {
  if (life_ == Life::starting) life_ = Life::ready;
  idle_memory_bytes_ = resident_bytes(pid_);
  say_status("");
  {
    const std::lock_guard lock(status_mutex_);
    sandbox_ = message.sandbox;
  }
  const auto start_ms = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - started_at_).count();
  log_(LogLevel::info, "worker_ready",
       {{"pid", std::to_string(pid_)},
        {"build", message.build},
        {"sandbox", message.sandbox},
        {"start_ms", std::to_string(start_ms)}});
}

void Supervisor::Loop::hear(Heartbeat& message) {
  kept_geometry_bytes_ = message.geometry_bytes;
  kept_picture_bytes_ = message.picture_bytes;
  watch_memory();
}

void Supervisor::Loop::watch_memory() {
  if (running_.empty() || life_ != Life::ready) return;
  const std::uint64_t kept = kept_geometry_bytes_ + kept_picture_bytes_;
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
    Received received = process_->receive();
    if (std::holds_alternative<Nothing>(received)) return;
    last_heard_ = Clock::now();
    if (auto* message = std::get_if<Message>(&received)) std::visit([this](auto& kind) { hear(kind); }, *message);
    if (auto* malformed = std::get_if<Malformed>(&received)) end_worker("sent " + malformed->detail, false);
    if (std::holds_alternative<Lost>(received)) end_worker("sent what this process had no descriptors for", true);
    if (std::holds_alternative<Closed>(received)) end_worker("", false);
  }
}

/// Its end is then told by its pid descriptor. Without a reason the way it ended is the reason: a socket at its end
/// means that the process is past changing it.
void Supervisor::Loop::end_worker(const std::string& why, bool excused, const char* code) {
  life_ = Life::ending;
  end_reason_ = why;
  end_code_ = code;
  end_excused_ = excused;
  process_->kill();
}

void Supervisor::Loop::worker_ended() {
  // What it said before it died still counts.
  while (life_ == Life::starting || life_ == Life::ready) {
    const Time heard_before = last_heard_;
    read_worker();
    if (last_heard_ == heard_before) break;
  }
  const std::string end = process_->reap();
  const std::string how = end_reason_.empty() ? end : end_reason_;
  log_(end_excused_ ? LogLevel::info : LogLevel::error, "worker_ended",
       {{"pid", std::to_string(pid_)}, {"how", how}, {"job_ids", list_of_jobs()}});

  std::vector<Casualty> casualties;
  for (const auto& [id, job] : running_) {
    casualties.push_back({id, job.fence, job.attempt, job.max_attempts, job.cancel_requested});
  }
  running_.clear();
  if (draining_ && !casualties.empty()) all_ended_ = false;
  settle(casualties, judge(casualties, how, end_excused_, end_code_));

  process_.reset();
  pid_ = 0;
  kept_geometry_bytes_ = kept_picture_bytes_ = 0;
  life_ = Life::absent;
  say_status("worker: restarting");
  restart_at_ = Clock::now();
  if (end_excused_) return;
  restart_at_ += restart_pause_;
  restart_pause_ = std::min(2 * restart_pause_, settings_.restart_pause_max);
}

std::string Supervisor::Loop::list_of_jobs() const {
  std::string list;
  for (const auto& [id, job] : running_) list += (list.empty() ? "" : " ") + id;
  return list;
}

}  // namespace worker
