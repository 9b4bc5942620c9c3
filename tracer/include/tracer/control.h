#pragma once
/// Control of a running compile or render: progress, cancellation, and access to the unfinished image.

#include <algorithm>
#include <atomic>
#include <cmath>
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

  /// Fraction of the way from the start of the compile to the image, in [0, 1], as far as known. Compiling counts if it
  /// takes rays: a scene whose light is found by patches.
  [[nodiscard]] double progress() const {
    constexpr double build_share = 0.5;
    const double total = static_cast<double>(tiles_total()), traced = static_cast<double>(tiles_done());
    const double of_tiles = total > 0 ? std::min(traced / total, 1.0) : 0;
    const double built = built_.load(std::memory_order_relaxed);
    return built > 0 ? build_share * (total > 0 ? 1 : built) + (1 - build_share) * of_tiles : of_tiles;
  }

  /// The remaining functions are called by the tracer only.
  void begin(std::uint64_t tiles) {
    done_.store(0, std::memory_order_relaxed);
    total_.store(tiles, std::memory_order_relaxed);
  }
  void reach(std::uint64_t done) {
    if (done > tiles_done()) done_.store(done, std::memory_order_relaxed);
  }
  void finish_tile() { done_.fetch_add(1, std::memory_order_relaxed); }
  /// Begins a step of the build. Their number is unknown: three of them take half of what is left of its progress.
  void begin_build_step() { ++build_steps_; }
  /// `part` of the step is done, in [0, 1]. Any thread.
  void reach_in_build_step(double part) {
    const double built = 1 - std::exp2((1 - part - build_steps_.load(std::memory_order_relaxed)) / 3.0);
    double before = built_.load(std::memory_order_relaxed);
    while (before < built && !built_.compare_exchange_weak(before, built, std::memory_order_relaxed)) continue;
  }

 private:
  std::atomic<bool> cancelled_{false};
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::uint64_t> total_{0};
  std::atomic<int> build_steps_{0};
  std::atomic<double> built_{0};
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
