#pragma once
/// Parallel loops over tiles.

#include <cstdint>
#include <functional>
#include <vector>

namespace tracer {

/// Calls a function with every number below `count`, in parallel; returns when all calls have returned.
using InParallel = std::function<void(std::uint64_t count, const std::function<void(std::uint64_t)>& work)>;

/// Maximum number of tiles traced concurrently.
std::uint32_t concurrency(std::uint32_t threads);

/// Calls tile(i) for every i in [0, count), on `threads` threads, or those of the calling arena when 0. Exceptions of a
/// tile stop the rest and are thrown here. Each call has the default floating-point arithmetic, whatever the thread
/// had.
void for_each_tile(std::uint64_t count, std::uint32_t threads, const std::function<void(std::uint64_t)>& tile);

/// The values of the vectors that make(i) returns for every i in [0, count), in this order; calls as for_each_tile().
template <class T, class Make>
std::vector<T> values_of_tiles(std::uint64_t count, const Make& make) {
  std::vector<std::vector<T>> parts(count);
  for_each_tile(count, 0, [&](std::uint64_t number) { parts[number] = make(number); });
  std::vector<T> all;
  for (std::vector<T>& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    part = {};
  }
  return all;
}

}  // namespace tracer
