#pragma once
/// Access to an image while it is rendered. Costs nothing until snapshot() is called.

#include <cstdint>
#include <mutex>
#include <optional>

#include "tracer/image.h"

namespace tracer {

class PreviewTiles;

/// Owned by the caller and used by one render at a time, which it must outlive.
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
