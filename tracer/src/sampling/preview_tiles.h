#pragma once
/// What a Preview sees of a render: tiles that are written to, one at a time each, and read in between.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "tracer/preview.h"
#include "tracer/src/math/vec.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Without a preview it does nothing. Nobody looks but while an Open lives.
class PreviewTiles {
 public:
  /// The colour of the pixel at a place of the window, read under the lock of its tile.
  using Mean = std::function<Color(std::size_t place)>;
  /// `preview` may be null. It and `tiles` must outlive this.
  PreviewTiles(Preview* preview, const Tiles& tiles, const PixelWindow& window, Mean mean);
  ~PreviewTiles();
  PreviewTiles(const PreviewTiles&) = delete;
  PreviewTiles& operator=(const PreviewTiles&) = delete;

  /// While it lives tiles are written to under their locks alone. All of one thread, that of the constructor.
  class Open {
   public:
    explicit Open(PreviewTiles& tiles) : tiles_(tiles) { tiles_.open(); }
    ~Open() { tiles_.close(); }
    Open(const Open&) = delete;
    Open& operator=(const Open&) = delete;

   private:
    PreviewTiles& tiles_;
  };

  /// A tile's lock, held for microseconds; whoever holds it has something to show afterwards.
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
  enum State : std::uint8_t { empty, to_display, locked };

  void open();
  void close();
  void lock(std::uint64_t tile) const;
  void unlock(std::uint64_t tile) const;
  [[nodiscard]] Image look(std::uint32_t side) const;

  Preview* preview_;
  const Tiles& tiles_;
  std::uint32_t width_, height_;
  Mean mean_;
  std::unique_ptr<std::atomic<std::uint8_t>[]> states_;  ///< of each tile; null without a preview
  std::unique_lock<std::mutex> closed_;
};

}  // namespace tracer
