#pragma once
/// Sources of time, random bits and ids, passed in so that tests can set them. Times are milliseconds since 1970 UTC.
///
/// Ids of jobs, boots and requests are UUIDv7 (RFC 9562, section 5.7) in lower case, so they sort by creation as text.

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

namespace queue {

using Clock = std::function<std::int64_t()>;  ///< any thread; must not throw

Clock system_clock();  ///< the machine's wall clock

using RandomBits = std::function<std::uint64_t()>;  ///< 64 uniform bits; called under IdSource's lock

RandomBits system_random();  ///< the kernel's generator; throws std::system_error when there is none

/// Each id is greater than all earlier ones of the same source, also within a millisecond and when the clock steps
/// back: the 12 bits after the version count within a millisecond (RFC 9562, section 6.2, method 1) and borrow from the
/// next one when they run out. Thread-safe.
class IdSource {
 public:
  IdSource(Clock clock, RandomBits random) : clock_(std::move(clock)), random_(std::move(random)) {}
  std::string next();

 private:
  Clock clock_;
  RandomBits random_;
  std::mutex mutex_;
  std::uint64_t millisecond_ = 0;
  std::uint64_t counter_ = 0;
};

}  // namespace queue
