#include "server/queue/periodic_task.h"

#include <exception>
#include <utility>

namespace queue {
namespace {

constexpr PeriodicTask::Pause pause_after_failure{250};

}  // namespace

PeriodicTask::PeriodicTask(std::string name, Log log, std::function<Pause()> step)
    : name_(std::move(name)), log_(std::move(log)), step_(std::move(step)), thread_([this] { run(); }) {}

PeriodicTask::~PeriodicTask() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_one();
  thread_.join();
}

void PeriodicTask::run() {
  std::unique_lock lock(mutex_);
  bool failing = false;
  while (!stopping_) {
    lock.unlock();
    Pause pause = pause_after_failure;
    try {
      pause = step_();
      failing = false;
    } catch (const std::exception& failure) {
      if (!failing) log_(LogLevel::error, "store_failure", {{"during", name_}, {"detail", failure.what()}});
      failing = true;
    }
    lock.lock();
    stop_.wait_for(lock, pause, [&] { return stopping_; });
  }
}

}  // namespace queue
