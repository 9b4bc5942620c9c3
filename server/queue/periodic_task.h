#pragma once
/// A thread that takes a small step again and again, with pauses between, so that nobody waits behind it.

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
  /// `step` takes a step and says how long to wait for the next one; it may throw. Failures are logged as
  /// "store_failure" during `what`, once until a step works again, and the next step follows after a quarter of a
  /// second.
  PeriodicTask(std::string what, Log log, std::function<Pause()> step);
  ~PeriodicTask();  ///< after the step in progress
  PeriodicTask(const PeriodicTask&) = delete;
  PeriodicTask& operator=(const PeriodicTask&) = delete;

 private:
  void run();

  const std::string what_;
  const Log log_;
  const std::function<Pause()> step_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;  ///< last: starts when the rest is there
};

}  // namespace queue
