#pragma once
/// Progress and cancellation of one compile or render.

#include <atomic>
#include <cstdint>

namespace tracer {

/// Owned by the caller, shared with any thread. Must outlive the compile or render that uses it.
class RenderControl {
 public:
  /// Any thread, any time, any number of times. Running work stops within one tile and returns `cancelled`; work that
  /// starts later returns it at once; finished work is not affected.
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

  /// Tiles traced and to be traced, or, with a target error, fractions of the way to it. Both are 0 before the start;
  /// tiles_done() only grows during one render.
  [[nodiscard]] std::uint64_t tiles_done() const { return done_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t tiles_total() const { return total_.load(std::memory_order_relaxed); }

  /// The remaining functions are called by the tracer only.
  void begin(std::uint64_t tiles) {
    done_.store(0, std::memory_order_relaxed);
    total_.store(tiles, std::memory_order_relaxed);
  }
  void reach(std::uint64_t done) {
    if (done > tiles_done()) done_.store(done, std::memory_order_relaxed);
  }
  void finish_tile() { done_.fetch_add(1, std::memory_order_relaxed); }

 private:
  std::atomic<bool> cancelled_{false};
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::uint64_t> total_{0};
};

}  // namespace tracer
