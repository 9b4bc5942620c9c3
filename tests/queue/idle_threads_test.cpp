/// Of idle threads the last one goes first.

#include "server/queue/idle_threads.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/queue/eventually.h"

namespace {

/// Threads that wait in the order of their numbers, and tell theirs when they were called.
class Pool {
 public:
  explicit Pool(int count) {
    for (int number = 0; number < count; ++number) {
      threads_.emplace_back([this, number] {
        std::unique_lock lock(mutex_);
        ++waiting_;
        idle_.wait(lock);
        called_.push_back(number);
      });
      EXPECT_TRUE(eventually([&] {
        const std::lock_guard lock(mutex_);
        return waiting_ == number + 1;
      }));
    }
  }
  void call(void (queue::IdleThreads::*which)()) {
    const std::lock_guard lock(mutex_);
    (idle_.*which)();
  }
  std::vector<int> called_when(std::size_t count) {
    EXPECT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex_);
      return called_.size() == count;
    }));
    const std::lock_guard lock(mutex_);
    return called_;
  }

 private:
  std::mutex mutex_;
  queue::IdleThreads idle_;
  std::vector<int> called_;
  int waiting_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace

TEST(IdleThreads, TheLastToGoIdleIsCalledFirst) {
  Pool pool(3);
  pool.call(&queue::IdleThreads::call_one);
  EXPECT_EQ(pool.called_when(1), std::vector{2});
  pool.call(&queue::IdleThreads::call_one);
  EXPECT_EQ(pool.called_when(2), (std::vector{2, 1}));
  pool.call(&queue::IdleThreads::call_one);
  EXPECT_EQ(pool.called_when(3), (std::vector{2, 1, 0}));
}

TEST(IdleThreads, ACallReachesAllWhoAreIdleAndNobodyElse) {
  queue::IdleThreads nobody;
  nobody.call_one();
  nobody.call_all();
  Pool pool(3);
  pool.call(&queue::IdleThreads::call_all);
  EXPECT_EQ(pool.called_when(3).size(), 3u);
}
