#include "server/jobs/housekeeper.h"

#include <exception>
#include <utility>

namespace jobs {

Housekeeper::Housekeeper(Queue& queue, Log log, HousekeeperSettings settings)
    : queue_(queue), log_(std::move(log)), settings_(settings), thread_([this] { run(); }) {}

Housekeeper::~Housekeeper() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_one();
  thread_.join();
}

void Housekeeper::run() {
  std::unique_lock lock(mutex_);
  bool failing = false;  // told once, not four times a second
  while (!stopping_) {
    lock.unlock();
    bool more = false;
    try {
      more = queue_.keep_house();
      failing = false;
    } catch (const std::exception& failure) {
      if (!failing) log_(LogLevel::error, "store_failure", {{"during", "keep_house"}, {"detail", failure.what()}});
      failing = true;
    }
    lock.lock();
    stop_.wait_for(lock, more ? settings_.pause : settings_.interval, [&] { return stopping_; });
  }
}

}  // namespace jobs
