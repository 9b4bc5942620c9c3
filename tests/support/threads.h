#pragma once
/// Threads of a test, and a wait for a condition.

#include <chrono>
#include <thread>
#include <vector>

/// Calls `work` with each number from 0 to `count` - 1 in a thread of its own. Returns when all have ended.
template <class Work>
void in_threads(int count, const Work& work) {
  std::vector<std::jthread> threads;
  for (int i = 0; i < count; ++i) threads.emplace_back([&work, i] { work(i); });
}

/// Waits with a time limit that only a hang exceeds.
template <class Condition>
[[nodiscard]] bool eventually(Condition condition) {
  const auto bound = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > bound) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}
