#pragma once
/// Parallel loops over tiles.

#include <cstdint>
#include <functional>

namespace tracer {

/// Calls a function with every number below `count`, in parallel; returns when all calls have returned.
using InParallel = std::function<void(std::uint64_t count, const std::function<void(std::uint64_t)>& work)>;

/// Maximum number of tiles traced concurrently.
std::uint32_t concurrency(std::uint32_t threads);

/// Calls tile(i) for every i in [0, count), on `threads` threads, or those of the calling arena when 0. Exceptions of a
/// tile stop the rest and are thrown here. Each call has the default floating-point arithmetic, whatever the thread
/// had.
void for_each_tile(std::uint64_t count, std::uint32_t threads, const std::function<void(std::uint64_t)>& tile);

}  // namespace tracer
