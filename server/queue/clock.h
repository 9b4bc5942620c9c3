#pragma once
/// The time as the queue reads it: milliseconds since 1970 UTC, passed in so that tests can set it.

#include <cstdint>
#include <functional>

namespace queue {

using Clock = std::function<std::int64_t()>;  ///< any thread; must not throw

Clock system_clock();  ///< the machine's wall clock

}  // namespace queue
