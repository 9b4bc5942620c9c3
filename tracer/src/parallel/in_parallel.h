#pragma once
/// Parallel loops as a parameter: the caller decides about threads.

#include <cstdint>
#include <functional>

namespace tracer {

/// Calls a function with every number below `count`, in parallel; returns when all calls have returned.
using InParallel = std::function<void(std::uint64_t count, const std::function<void(std::uint64_t)>& work)>;

}  // namespace tracer
