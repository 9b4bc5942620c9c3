#pragma once
/// Control of a running compile or render: progress, cancellation, and access to the unfinished image.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include "tracer/image.h"

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

class PreviewTiles;

/// Access to an image while it is rendered. Costs nothing until snapshot() is called. Owned by the caller and used by
/// one render at a time, which it must outlive.
class Preview {
 public:
  /// The image so far: the whole window, box-filtered to at most `side` (>= 1) pixels along its longer side; linear and
  /// premultiplied by `alpha`, which is 0 for pixels not traced yet. Any thread. Returns nothing while the render
  /// publishes no tiles (before the start, between adaptive rounds); retry later. Takes milliseconds: at most about 16
  /// rendered pixels are read per returned pixel. The render waits only for the tile that is being read. Throws
  /// std::bad_alloc.
  std::optional<Image> snapshot(std::uint32_t side);

 private:
  friend class PreviewTiles;
  std::mutex mutex_;  ///< held during snapshot(), and by the render while its tiles must not be read
  const PreviewTiles* tiles_ = nullptr;
};

}  // namespace tracer
