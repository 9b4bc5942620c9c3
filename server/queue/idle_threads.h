#pragma once
/// Threads of a pool that have nothing to do. Who went idle last is called first, while its memory is at hand: a
/// condition variable alone calls all in turn, and each comes back to cold caches.

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <vector>

namespace queue {

/// Every call under the pool's one mutex.
class IdleThreads {
 public:
  /// Until called. Who is to find something to do looks for it before and after.
  void wait(std::unique_lock<std::mutex>& lock) {
    std::condition_variable called;
    idle_.push_back(&called);
    called.wait(lock, [&] { return std::find(idle_.begin(), idle_.end(), &called) == idle_.end(); });
  }
  void call_one() {
    if (idle_.empty()) return;
    idle_.back()->notify_one();
    idle_.pop_back();
  }
  void call_all() {
    while (!idle_.empty()) call_one();
  }

 private:
  std::vector<std::condition_variable*> idle_;
};

}  // namespace queue
