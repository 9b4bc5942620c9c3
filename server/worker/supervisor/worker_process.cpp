#include "server/worker/supervisor/worker_process.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <system_error>
#include <utility>

#include "server/support/locked.h"
#include "server/support/process_memory.h"
#include "server/worker/supervisor/message_check.h"

namespace worker {

using queue::LogLevel;

static std::uint64_t memory_of(int pid) { return static_cast<std::uint64_t>(support::resident_bytes(pid).value_or(0)); }

// ---- start

WorkerProcess::Instance::Instance(const SupervisorSettings& settings) : child(settings.executable) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::system_error(errno, std::generic_category(), "socketpair");
  Descriptor workers(ends[1]);
  files = std::make_unique<FileServer>(Descriptor(ends[0]), settings.files, settings.open_upload);
  child.send(pack(Configure{settings, std::move(workers)}));
}

void WorkerProcess::start_if_due(Time now) {
  if (!may_start_ || state_ != WorkerState::absent || now < restart_at_) return;
  try {
    worker_ = std::make_unique<Instance>(settings_);
  } catch (const std::exception& failure) {
    log_(LogLevel::error, "worker_not_started", {{"detail", failure.what()}});
    set_not_ready(std::string("worker: ") + failure.what());
    restart_at_ = now + settings_.restart_pause_max;
    return;
  }
  state_ = WorkerState::starting;
  last_message_at_ = now;
  pid_ = worker_->child.pid();
  log_(LogLevel::info, "worker_started", {{"pid", std::to_string(pid_)}, {"slots", std::to_string(settings_.slots)}});
}

void WorkerProcess::on_ready(const Ready& ready) {
  state_ = WorkerState::ready;
  base_memory_bytes_ = memory_of(pid_);
  set_not_ready("");
  support::locked(status_mutex_, [&] { sandbox_ = ready.sandbox; });
  const auto start_ms = std::chrono::duration_cast<std::chrono::milliseconds>(Time::clock::now() - worker_->started_at);
  log_(LogLevel::info, "worker_ready",
       {{"pid", std::to_string(pid_)},
        {"build", ready.build},
        {"sandbox", ready.sandbox},
        {"start_ms", std::to_string(start_ms.count())}});
  if (ready.sandbox != full_sandbox)
    log_(LogLevel::warning, "sandbox_incomplete", {{"sandbox", ready.sandbox}, {"full", full_sandbox}});
}

// ---- messages and output

void WorkerProcess::wait(int event_descriptor, Time until) {
  // A closed socket would end every wait at once.
  const bool connected = worker_ != nullptr && state_ != WorkerState::ending;
  const int writable = connected && worker_->child.has_unsent() ? POLLOUT : 0;
  std::vector<pollfd> descriptors{
      {event_descriptor, POLLIN, 0},
      {connected ? worker_->child.socket() : -1, static_cast<short>(POLLIN | writable), 0},
      {worker_ != nullptr ? worker_->child.pid_descriptor() : -1, POLLIN, 0},
      {worker_ != nullptr ? worker_->child.output().descriptor() : -1, POLLIN, 0},
  };
  for (const auto& instance : killed_) descriptors.push_back({instance->child.pid_descriptor(), POLLIN, 0});
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Time::clock::now()).count();
  poll(descriptors.data(), descriptors.size(), static_cast<int>(std::clamp<decltype(left)>(left, 0, 60'000)));

  auto killed = descriptors.end() - static_cast<std::ptrdiff_t>(killed_.size());
  std::erase_if(killed_, [&](const auto& instance) {
    if (((killed++)->revents & POLLIN) == 0) return false;
    log_output(instance->child);
    return true;
  });
  if ((descriptors[1].revents & POLLOUT) != 0) worker_->child.flush();
  exited_ = (descriptors[2].revents & POLLIN) != 0;
  if (descriptors[3].revents != 0) log_output(worker_->child);
}

std::optional<Message> WorkerProcess::receive(std::size_t job_count) {
  if (state_ != WorkerState::starting && state_ != WorkerState::ready) return std::nullopt;
  Received received = worker_->child.receive();
  if (std::holds_alternative<Nothing>(received)) return std::nullopt;
  last_message_at_ = Time::clock::now();
  if (auto* message = std::get_if<Message>(&received)) {
    if (const std::string violation = violation_of(*message); !violation.empty()) {
      end(violation, false);
      return std::nullopt;
    }
    if (const auto* ready = std::get_if<Ready>(message)) {
      if (state_ == WorkerState::starting) on_ready(*ready);
    } else if (const auto* heartbeat = std::get_if<Heartbeat>(message)) {
      on_heartbeat(*heartbeat, job_count);
    }
    return std::move(*message);
  }
  if (auto* malformed = std::get_if<Malformed>(&received)) {
    end("sent " + malformed->detail, false);
  } else if (std::holds_alternative<Lost>(received)) {
    end("sent a message for which this process has no descriptors", true);
  } else {
    state_ = WorkerState::ending;  // how it ended is known when the process has exited
    worker_->child.kill();
  }
  return std::nullopt;
}

void WorkerProcess::send(Packet packet) {
  if (state_ == WorkerState::ready) worker_->child.send(std::move(packet));
}

void WorkerProcess::on_heartbeat(const Heartbeat& heartbeat, std::size_t job_count) {
  cache_geometry_bytes_ = heartbeat.geometry_bytes;
  cache_image_bytes_ = heartbeat.image_bytes;
  if (job_count == 0 || state_ != WorkerState::ready) return;
  const std::uint64_t cached = heartbeat.geometry_bytes + heartbeat.image_bytes;
  const std::uint64_t limit =
      base_memory_bytes_ + std::min(cached, settings_.scene_cache_bytes) + job_count * settings_.job_memory_bytes;
  const std::uint64_t used = memory_of(pid_);
  if (used <= limit) return;
  end("had " + std::to_string(used) + " bytes of memory, above the limit job_memory_bytes of " +
          std::to_string(settings_.job_memory_bytes) + " for each job,",
      false, "out_of_memory");
}

/// Output consists mostly of messages of libraries.
void WorkerProcess::log_output(ChildProcess& child) const {
  child.output().read(Time::clock::now(), [&](const std::string& text, std::uint64_t omitted_lines) {
    queue::LogFields fields{{"worker", std::to_string(child.pid())}, {"text", text}};
    if (omitted_lines > 0) fields.emplace_back("omitted_lines", std::to_string(omitted_lines));
    log_(LogLevel::warning, "worker_output", fields);
  });
}

// ---- exit

void WorkerProcess::end(const std::string& reason, bool planned_shutdown, const char* code) {
  if (state_ == WorkerState::absent || state_ == WorkerState::ending) return;
  worker_->child.kill();
  killed_.push_back(std::move(worker_));
  on_exit(reason, planned_shutdown, code);
}

void WorkerProcess::reap_if_exited() {
  if (!exited_) return;
  log_output(worker_->child);
  const std::string reason = worker_->child.reap();
  worker_.reset();
  on_exit(reason, false, "worker_crashed");
}

void WorkerProcess::on_exit(const std::string& reason, bool planned_shutdown, const char* code) {
  exit_ = {pid_, reason, planned_shutdown, code};
  exited_ = false;
  pid_ = 0;
  cache_geometry_bytes_ = cache_image_bytes_ = 0;
  state_ = WorkerState::absent;
  set_not_ready("worker: restarting");
  restart_at_ = Time::clock::now();
  if (planned_shutdown) return;
  restart_at_ += restart_pause_;
  restart_pause_ = std::min(2 * restart_pause_, settings_.restart_pause_max);
}

void WorkerProcess::check_timeouts(Time now) {
  if (state_ == WorkerState::starting && now >= worker_->started_at + settings_.start_timeout)
    end("was not ready within " + std::to_string(settings_.start_timeout.count()) + " ms", false);
  if (state_ == WorkerState::ready && now >= last_message_at_ + settings_.heartbeat_timeout) {
    end("sent no heartbeat within the heartbeat timeout", false);
  }
}

WorkerProcess::Time WorkerProcess::next_deadline() const {
  if (state_ == WorkerState::absent && may_start_) return restart_at_;
  if (state_ == WorkerState::starting) return worker_->started_at + settings_.start_timeout;
  return state_ == WorkerState::ready ? last_message_at_ + settings_.heartbeat_timeout : Time::max();
}

std::string WorkerProcess::sandbox() const {
  const std::lock_guard lock(status_mutex_);
  return sandbox_;
}

std::string WorkerProcess::not_ready() const {
  const std::lock_guard lock(status_mutex_);
  return not_ready_;
}

void WorkerProcess::set_not_ready(std::string reason) {
  const std::lock_guard lock(status_mutex_);
  not_ready_ = std::move(reason);
}

}  // namespace worker
