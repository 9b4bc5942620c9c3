#pragma once
/// The state of the disk for jobs, images and uploads: free space and failures.

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "server/queue/job_store.h"

namespace queue {

/// Free space of the disk.
struct DiskSpace {
  enum class State {
    enough,
    scarce,  ///< below the reserve: no submission is accepted, accepted jobs run and end
    none,    ///< also no job is claimed; running ones may end
  };
  State state = State::enough;
  std::uint64_t free_bytes = 0;
  std::uint64_t reserve_bytes = 0;  ///< kept for accepted jobs
};

using DiskSpaceProbe = std::function<DiskSpace()>;  ///< any thread; returns at once; must not throw

/// For operators and clients, of a state other than `enough`.
inline std::string describe(const DiskSpace& space) {
  return std::to_string(space.free_bytes) + " bytes are free on the disk, " + std::to_string(space.reserve_bytes) +
         " are kept for jobs that were accepted before";
}

/// Health of a disk. After an I/O error (StoreFailure::Kind::broken) its content is unknown: a sync that failed once
/// may succeed the next time with the data lost (Rebello et al., "Can Applications Recover from fsync Failures?",
/// USENIX ATC 2020). So the first such failure is the last write: later ones are rejected, and the program must restart
/// from the real content of the disk.
///
/// One for all stores on a disk; must outlive them. Thread-safe.
class DiskHealth {
 public:
  /// `on_failure` is called once, by the thread with the failure, before its caller gets it; must return at once.
  explicit DiskHealth(std::function<void(const std::string& what)> on_failure = {})
      : on_failure_(std::move(on_failure)) {}

  /// Calls `write` unless the disk has failed.
  template <class Write>
  auto run(Write write) {
    check();
    try {
      return write();
    } catch (const StoreFailure& failure) {
      if (failure.kind == StoreFailure::Kind::broken) set_failed(failure);
      throw;
    }
  }

  /// Throws the failure when there was one.
  void check() const {
    const std::lock_guard lock(mutex_);
    if (failure_) throw StoreFailure(*failure_);
  }

 private:
  void set_failed(const StoreFailure& failure) {
    {
      const std::lock_guard lock(mutex_);
      if (failure_) return;
      failure_ = failure;
    }
    if (on_failure_) on_failure_(failure.what());
  }

  const std::function<void(const std::string& what)> on_failure_;
  mutable std::mutex mutex_;
  std::optional<StoreFailure> failure_;
};

}  // namespace queue
