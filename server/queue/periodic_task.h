#pragma once
/// A thread that repeats a small step with pauses between.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "server/queue/event_log.h"

namespace queue {

class PeriodicTask {
 public:
  using Pause = std::chrono::milliseconds;
  /// `step` returns the pause before the next one; it may throw. Failures are logged as "store_failure" during `name`,
  /// once until a step succeeds again, and the next step follows after a quarter of a second.
  PeriodicTask(std::string name, Log log, std::function<Pause()> step);
  ~PeriodicTask();  ///< after the step in progress
  PeriodicTask(const PeriodicTask&) = delete;
  PeriodicTask& operator=(const PeriodicTask&) = delete;

 private:
  void run();

  const std::string name_;
  const Log log_;
  const std::function<Pause()> step_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;  ///< last: it uses all other members
};

}  // namespace queue
