#include "server/worker/supervisor/store_executor.h"

#include <utility>

namespace worker {

StoreExecutor::StoreExecutor(int threads, std::chrono::milliseconds pause, queue::Log log)
    : pause_(pause), log_(std::move(log)) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run_tasks(); });
}

StoreExecutor::~StoreExecutor() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  task_available_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void StoreExecutor::run(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  task_available_.notify_one();
}

void StoreExecutor::run_tasks() {
  std::unique_lock lock(mutex_);
  for (;;) {
    task_available_.wait(lock, [&] { return stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

std::optional<queue::StoreFailure> StoreExecutor::run_with_retry(int tries, std::string_view operation,
                                                                 const std::function<void()>& call) {
  for (int tried = 1;; ++tried) {
    std::optional<queue::StoreFailure> failure;
    try {
      call();
      return std::nullopt;
    } catch (const queue::StoreFailure& thrown) {
      failure = thrown;
    } catch (const std::exception& thrown) {  // no memory or descriptors
      failure.emplace(queue::StoreFailure::Kind::unavailable, thrown.what());
    }
    log_(queue::LogLevel::error, "store_failure", {{"during", std::string(operation)}, {"detail", failure->what()}});
    const bool broken = failure->kind == queue::StoreFailure::Kind::broken;
    if (broken || tried == tries || !pause()) return failure;
  }
}

void StoreExecutor::stop_retrying() {
  const std::lock_guard lock(mutex_);
  retrying_ = false;
  retrying_stopped_.notify_all();
}

bool StoreExecutor::pause() {
  std::unique_lock lock(mutex_);
  return !retrying_stopped_.wait_for(lock, pause_, [&] { return !retrying_; });
}

}  // namespace worker
