#include "server/worker/supervisor/store_executor.h"

#include <utility>

namespace worker {

StoreExecutor::StoreExecutor(int threads, std::chrono::milliseconds pause, queue::Log log)
    : pause_(pause), log_(std::move(log)) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

StoreExecutor::~StoreExecutor() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    idle_.call_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

void StoreExecutor::run(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  tasks_.push_back(std::move(task));
  idle_.call_one();
}

void StoreExecutor::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    while (tasks_.empty()) {
      if (stopping_) return;
      idle_.wait(lock);
    }
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

std::optional<queue::StoreFailure> StoreExecutor::run_with_retry(int tries, std::string_view what,
                                                                 const std::function<void()>& call) {
  for (int tried = 1;; ++tried) {
    std::optional<queue::StoreFailure> failure;
    try {
      call();
      return std::nullopt;
    } catch (const queue::StoreFailure& thrown) {
      failure = thrown;
    } catch (const std::exception& thrown) {  // no memory, no descriptors: the environment too
      failure.emplace(queue::StoreFailure::Kind::unavailable, thrown.what());
    }
    log_(queue::LogLevel::error, "store_failure", {{"during", std::string(what)}, {"detail", failure->what()}});
    const bool broken = failure->kind == queue::StoreFailure::Kind::broken;
    if (broken || tried == tries || !wait_a_little()) return failure;
  }
}

void StoreExecutor::give_up() {
  const std::lock_guard lock(mutex_);
  given_up_ = true;
  gave_up_.notify_all();
}

bool StoreExecutor::wait_a_little() {
  std::unique_lock lock(mutex_);
  return !gave_up_.wait_for(lock, pause_, [&] { return given_up_; });
}

}  // namespace worker
