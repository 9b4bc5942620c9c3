#pragma once
/// Results that could not be stored yet, in a limited space on the disk.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "server/queue/event_log.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/supervisor.h"

namespace worker {

/// While the store of images or the database is away, finished jobs wait here. One of them is tried again after each
/// SupervisorSettings::store_pause, and when it is stored, the others follow at once, in their order. Their leases are
/// renewed meanwhile. Files without names hold their images, so that a killed daemon leaves none. Thread-safe.
class ResultBacklog {
 public:
  /// Stores a result; throws if it cannot.
  using Store = std::function<void(const Finished&)>;
  /// `on_change` is called by any thread when `size` has decreased.
  ResultBacklog(const SupervisorSettings& settings, Store store, std::function<void()> on_change, queue::Log log);
  ~ResultBacklog();  ///< as stop
  ResultBacklog(ResultBacklog&&) = delete;

  void add(Finished result);
  /// Drops the results: their jobs are rendered again when the leases have ended, and the attempts do not count.
  void stop();

  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool is_full() const;

 private:
  struct Waiting {
    Finished result;
    std::uint64_t bytes = 0;
  };
  void run();
  void move_to_disk(Image& image) const;
  bool store_first(std::unique_lock<std::mutex>& lock);

  const SupervisorSettings& settings_;
  const Store store_;
  const std::function<void()> on_change_;
  const queue::Log log_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Waiting>> waiting_;
  std::uint64_t bytes_ = 0;  ///< size of all that wait
  bool stopping_ = false;
  std::thread thread_;  ///< last: it uses all other members
};

}  // namespace worker
