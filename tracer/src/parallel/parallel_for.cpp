#include "tracer/src/parallel/parallel_for.h"

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#else
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#endif

#include <cfenv>

namespace tracer {
std::uint32_t concurrency(std::uint32_t threads) {
#if defined(__SANITIZE_THREAD__)
  return threads != 0 ? threads : 2;
#else
  return threads != 0 ? threads : static_cast<std::uint32_t>(std::max(1, tbb::this_task_arena::max_concurrency()));
#endif
}

void for_each_tile(std::uint64_t count, std::uint32_t threads, const std::function<void(std::uint64_t)>& tile) {
  // Embree lets threads of oneTBB round subnormal numbers to zero: an image would depend on the threads of its tiles.
  const auto trace = [&](std::uint64_t i) {
    std::fenv_t before;
    std::fegetenv(&before);
    std::fesetenv(FE_DFL_ENV);
    tile(i);
    std::fesetenv(&before);
  };
  if (count == 1) return trace(0);  // without the cost of the scheduler, for small images
#if defined(__SANITIZE_THREAD__)
  // The library of oneTBB is not instrumented, so ThreadSanitizer reports false races in it. Plain threads replace it.
  std::atomic<std::uint64_t> next{0};
  std::mutex mutex;
  std::exception_ptr thrown;
  const auto work = [&] {
    try {
      for (std::uint64_t i = next++; i < count; i = next++) trace(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      thrown = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> helpers;
    while (helpers.size() + 1 < concurrency(threads)) helpers.emplace_back(work);
    work();
  }
  if (thrown) std::rethrow_exception(thrown);
#else
  const auto run = [&] { tbb::parallel_for(std::uint64_t{0}, count, trace); };
  if (threads == 0) {
    run();
  } else {
    tbb::task_arena(static_cast<int>(threads)).execute(run);
  }
#endif
}

}  // namespace tracer
