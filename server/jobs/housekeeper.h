#pragma once
/// Keeps house in the queue from a thread of its own: deadlines of waiting jobs, jobs that become due, expiry. In small
/// steps with pauses between, so that nobody waits behind it.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/jobs/log.h"
#include "server/jobs/queue.h"

namespace jobs {

struct HousekeeperSettings {
  /// A run_after, a deadline or an expiry is kept to this; each round costs a read of a few indexes.
  std::chrono::milliseconds interval{250};
  /// Between steps while there is more to do: most of the writer's time is for others.
  std::chrono::milliseconds pause{20};
};

class Housekeeper {
 public:
  /// `queue` must outlive it.
  Housekeeper(Queue& queue, Log log, HousekeeperSettings settings = {});
  ~Housekeeper();  ///< after the step in progress
  Housekeeper(const Housekeeper&) = delete;
  Housekeeper& operator=(const Housekeeper&) = delete;

 private:
  void run();

  Queue& queue_;
  Log log_;
  HousekeeperSettings settings_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;  ///< last: starts when the rest is there
};

}  // namespace jobs
