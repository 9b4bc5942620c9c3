#pragma once
/// Tiles of a running render for a Preview: each is written by one thread at a time and read in between.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "tracer/control.h"
#include "tracer/src/math/vec.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Without a preview all functions do nothing. A preview reads tiles only while an Open lives.
class PreviewTiles {
 public:
  /// The color of the pixel at a place of the window, read under the lock of its tile.
  using Mean = std::function<Color(std::size_t place)>;
  /// `preview` may be null. It and `tiles` must outlive this.
  PreviewTiles(Preview* preview, const Tiles& tiles, const PixelWindow& window, Mean mean);
  ~PreviewTiles();
  PreviewTiles(const PreviewTiles&) = delete;
  PreviewTiles& operator=(const PreviewTiles&) = delete;

  /// Publishes the tiles: while it lives, they are written under their locks only. To be created and destroyed on the
  /// thread of the constructor.
  class Open {
   public:
    explicit Open(PreviewTiles& tiles) : tiles_(tiles) {
      if (tiles_.preview_ != nullptr) tiles_.closed_.unlock();
    }
    ~Open() {
      if (tiles_.preview_ != nullptr) tiles_.closed_.lock();
    }
    Open(const Open&) = delete;
    Open& operator=(const Open&) = delete;

   private:
    PreviewTiles& tiles_;
  };

  /// Lock of a tile, held for microseconds. After the first unlock() the tile is visible.
  class Tile {
   public:
    Tile(PreviewTiles& tiles, std::uint64_t index) : tiles_(tiles), index_(index) {}
    void lock() { tiles_.lock(index_); }
    void unlock() { tiles_.unlock(index_); }

   private:
    PreviewTiles& tiles_;
    std::uint64_t index_;
  };

 private:
  friend class Preview;
  enum State : std::uint8_t { empty, visible, locked };

  void lock(std::uint64_t tile) const;
  void unlock(std::uint64_t tile) const;
  [[nodiscard]] Image read(std::uint32_t side) const;

  Preview* preview_;
  const Tiles& tiles_;
  std::uint32_t width_, height_;
  Mean mean_;
  std::unique_ptr<std::atomic<std::uint8_t>[]> states_;  ///< by tile; null without a preview
  std::unique_lock<std::mutex> closed_;
};

}  // namespace tracer
