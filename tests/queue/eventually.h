#pragma once
/// Waiting for a condition, with a bound so generous that only a hang meets it.

#include <chrono>
#include <thread>

template <class Condition>
[[nodiscard]] bool eventually(Condition condition) {
  const auto bound = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > bound) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}
