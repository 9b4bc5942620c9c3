#include "server/worker/supervisor/supervisor.h"

#include <filesystem>
#include <utility>

#include "server/worker/supervisor/supervisor_loop.h"

namespace worker {

std::string worker_beside_this_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "whittled-worker";
}

Supervisor::Supervisor(queue::Queue& queue, SupervisorSettings settings, queue::Log log)
    : queue_(queue), loop_(std::make_unique<Loop>(queue, std::move(settings), std::move(log))) {
  queue_.runner.attach(loop_.get());
  loop_->notify(false);  // for what was submitted in between
}

Supervisor::~Supervisor() {
  queue_.runner.attach(nullptr);
  loop_->drain(std::chrono::milliseconds(0));
}

bool Supervisor::drain(std::chrono::milliseconds patience) { return loop_->drain(patience); }
int Supervisor::worker_pid() const { return loop_->pid(); }
int Supervisor::running() const { return loop_->running(); }
Supervisor::Kept Supervisor::kept() const { return loop_->kept(); }
std::string Supervisor::sandbox() const { return loop_->sandbox(); }

}  // namespace worker
