#pragma once
/// Waits for a condition, with a time limit that only a hang exceeds.

#include <chrono>
#include <thread>

template <class Condition>
[[nodiscard]] bool eventually(Condition condition) {
  const auto bound = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > bound) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}
