#include "server/http/handler_pool.h"

#include <malloc.h>

#include <algorithm>

namespace http {

HandlerPool::HandlerPool(std::size_t threads, std::size_t waiting_max, const std::vector<Route>& routes,
                         const telemetry::Log& log)
    : heavy_max_(std::max<std::size_t>(1, threads / 2)), waiting_max_(waiting_max) {
  for (std::size_t i = 0; i < threads; ++i) {
    threads_.emplace_back([this, routes, log] { run(routes, log); });
  }
}

HandlerPool::~HandlerPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    idle_.call_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

bool HandlerPool::submit(Task task, bool heavy) {
  const std::lock_guard lock(mutex_);
  if (light_.size() + heavy_.size() >= waiting_max_) return false;
  (heavy ? heavy_ : light_).push_back(std::move(task));
  idle_.call_one();
  return true;
}

void HandlerPool::resume(Task task) {
  const std::lock_guard lock(mutex_);
  light_.push_front(std::move(task));
  idle_.call_one();
}

void HandlerPool::run(const std::vector<Route>& routes, const telemetry::Log& log) {
  Router router(routes, log);
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto heavy_may_run = [&] { return !heavy_.empty() && heavy_running_ < heavy_max_; };
    const auto all_taken = [&] { return light_.empty() && heavy_.empty(); };
    while (light_.empty() && !heavy_may_run() && !(stopping_ && all_taken())) idle_.wait(lock);
    if (all_taken()) return;
    const bool heavy = heavy_may_run();
    std::deque<Task>& queue = heavy ? heavy_ : light_;
    const Task task = std::move(queue.front());
    queue.pop_front();
    heavy_running_ += heavy ? 1 : 0;
    lock.unlock();
    task(router);
    if (heavy) malloc_trim(0);  // parsing 64 MiB of JSON leaves many times that in freed pieces
    lock.lock();
    heavy_running_ -= heavy ? 1 : 0;
    if (stopping_) idle_.call_all();
  }
}

}  // namespace http
