#include "server/http/handler_pool.h"

#include <malloc.h>

#include <algorithm>

namespace http {

HandlerPool::HandlerPool(std::size_t threads, std::size_t waiting_max)
    : large_max_(std::max<std::size_t>(1, threads / 2)), waiting_max_(waiting_max) {
  for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

HandlerPool::~HandlerPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool HandlerPool::submit(Task task, bool large_body) {
  {
    const std::lock_guard lock(mutex_);
    if (small_.size() + large_.size() >= waiting_max_) return false;
    (large_body ? large_ : small_).push_back(std::move(task));
  }
  changed_.notify_one();
  return true;
}

void HandlerPool::resume(Task task) {
  {
    const std::lock_guard lock(mutex_);
    small_.push_front(std::move(task));
  }
  changed_.notify_one();
}

void HandlerPool::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto large_may_run = [&] { return !large_.empty() && large_running_ < large_max_; };
    const auto all_taken = [&] { return small_.empty() && large_.empty(); };
    changed_.wait(lock, [&] { return !small_.empty() || large_may_run() || (stopping_ && all_taken()); });
    if (all_taken()) return;
    const bool large = large_may_run();
    std::deque<Task>& queue = large ? large_ : small_;
    Task task = std::move(queue.front());
    queue.pop_front();
    large_running_ += large ? 1 : 0;
    lock.unlock();
    task();
    task = nullptr;             // frees the request without the lock
    if (large) malloc_trim(0);  // parsing 64 MiB of JSON leaves a multiple of that in freed blocks
    lock.lock();
    large_running_ -= large ? 1 : 0;
    if (stopping_) changed_.notify_all();
  }
}

}  // namespace http
