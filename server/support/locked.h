#pragma once
/// Short work under a lock.

#include <mutex>

namespace support {

/// Returns work(), which runs while the mutex is locked.
template <class Mutex, class Work>
auto locked(Mutex& mutex, const Work& work) {
  const std::lock_guard lock(mutex);
  return work();
}

}  // namespace support
