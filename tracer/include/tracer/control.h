#pragma once
/// Progress and cancellation of one compile or render: one object, held by the caller, shared with any thread.

#include <atomic>
#include <cstdint>

namespace tracer {

class RenderControl {
 public:
  /// Any thread, any time, any number of times. Work in progress stops within a tile and answers `cancelled`;
  /// before it starts: it answers at once; after it ended: nothing happens.
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

  /// Tiles traced and to be traced, or parts of the way to the accuracy that was asked for; only grows while one render
  /// runs. 0 of 0 before it starts.
  [[nodiscard]] std::uint64_t tiles_done() const { return done_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t tiles_total() const { return total_.load(std::memory_order_relaxed); }

  /// Used by the tracer.
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
