#pragma once
/// Threads that run short tasks for an event loop, which waits neither for handlers nor for a disk.

#include <malloc.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "server/support/locked.h"

namespace support {

class ThreadPool {
 public:
  /// Must not throw.
  using Task = std::function<void()>;
  /// `slow` and `one_at_a_time` tasks take up to seconds. Together they use at most half of the threads (at least one)
  /// and of the queue, so that ordinary ones do not wait; only one `one_at_a_time` task runs at once.
  enum Lane { ordinary, slow, one_at_a_time };

  /// `waiting_max`: length of the queue, for `submit`.
  explicit ThreadPool(std::size_t threads, std::size_t waiting_max = 0)
      : slow_max_(std::max<std::size_t>(1, threads / 2)), waiting_max_(waiting_max) {
    for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
  }

  /// Finishes the queued tasks.
  ~ThreadPool() {
    locked(mutex_, [&] { stopping_ = true; });
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  /// Returns false at once if the queue is full.
  bool submit(Task task, Lane lane) {
    {
      const std::lock_guard lock(mutex_);
      const std::size_t slow_waiting = lanes_[slow].size() + lanes_[one_at_a_time].size();
      if (lanes_[ordinary].size() + slow_waiting >= waiting_max_) return false;
      if (lane != ordinary && slow_waiting >= std::max<std::size_t>(1, waiting_max_ / 2)) return false;
      lanes_[lane].push_back(std::move(task));
    }
    changed_.notify_one();
    return true;
  }

  /// Queues an ordinary task, which is never refused, as the last or `first` in line.
  void add(Task task, bool first = false) {
    std::deque<Task>& lane = lanes_[ordinary];
    locked(mutex_, [&] { lane.insert(first ? lane.begin() : lane.end(), std::move(task)); });
    changed_.notify_one();
  }

 private:
  [[nodiscard]] bool may_run(Lane lane) const {
    if (lanes_[lane].empty()) return false;
    if (lane == ordinary) return true;
    return running_[slow] + running_[one_at_a_time] < slow_max_ && (lane == slow || running_[lane] == 0);
  }

  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      const auto all_taken = [&] { return std::ranges::all_of(lanes_, [](const auto& lane) { return lane.empty(); }); };
      std::optional<Lane> next;
      changed_.wait(lock, [&] {
        for (const Lane lane : {ordinary, slow, one_at_a_time})  // the last that may run is chosen
          if (may_run(lane)) next = lane;
        return next || (stopping_ && all_taken());
      });
      if (!next) return;
      Task task = std::move(lanes_[*next].front());
      lanes_[*next].pop_front();
      ++running_[*next];
      lock.unlock();
      task();
      task = nullptr;                         // frees what it holds without the lock
      if (*next != ordinary) malloc_trim(0);  // parsing 64 MiB of JSON leaves a multiple of that in freed blocks
      lock.lock();
      --running_[*next];
      if (stopping_) changed_.notify_all();
    }
  }

  const std::size_t slow_max_, waiting_max_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::array<std::deque<Task>, 3> lanes_;
  std::array<std::size_t, 3> running_{};
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace support
