#include "server/worker/supervisor/supervisor.h"

#include <filesystem>
#include <utility>

#include "server/worker/supervisor/supervisor_loop.h"

namespace worker {

std::string default_executable() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "whittled-worker";
}

Supervisor::Supervisor(queue::Queue& queue, SupervisorSettings settings, queue::Log log)
    : queue_(queue), loop_(std::make_unique<Loop>(queue, std::move(settings), std::move(log))) {
  queue_.runner.attach(loop_.get());
  loop_->notify(false);  // for jobs that were submitted before attach
}

Supervisor::~Supervisor() {
  queue_.runner.attach(nullptr);
  loop_->drain(std::chrono::milliseconds(0));
}

bool Supervisor::drain(std::chrono::milliseconds timeout) { return loop_->drain(timeout); }
int Supervisor::worker_pid() const { return loop_->process().pid(); }
int Supervisor::running() const { return loop_->dispatcher().running(); }
Supervisor::CacheBytes Supervisor::cache_bytes() const { return loop_->process().cache_bytes(); }
std::string Supervisor::sandbox() const { return loop_->process().sandbox(); }

}  // namespace worker
