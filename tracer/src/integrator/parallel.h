#pragma once
/// Runs tiles on oneTBB. The one place that knows it.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstdint>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace tracer {

/// Calls tile(i) for every i in [0, count), on `threads` threads, or those of the calling arena when 0. Exceptions of a
/// tile stop the rest and are thrown here. oneTBB's library is not instrumented, so ThreadSanitizer cannot see that a
/// tile starts after this call and ends before it returns: it is told.
template <class Tile>
void for_each_tile(std::uint64_t count, std::uint32_t threads, const Tile& tile) {
#if defined(__SANITIZE_THREAD__)
  char fork = 0, join = 0;
  const auto body = [&](std::uint64_t i) {
    __tsan_acquire(&fork);
    tile(i);
    __tsan_release(&join);
  };
  __tsan_release(&fork);
#else
  const auto& body = tile;
#endif
  const auto run = [&] { tbb::parallel_for(std::uint64_t{0}, count, body); };
  if (threads == 0) {
    run();
  } else {
    tbb::task_arena(static_cast<int>(threads)).execute(run);
  }
#if defined(__SANITIZE_THREAD__)
  __tsan_acquire(&join);
#endif
}

}  // namespace tracer
