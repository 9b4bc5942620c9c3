#pragma once
/// A look at an image while it is traced. A render that nobody looks at makes nothing for it.

#include <cstdint>
#include <mutex>
#include <optional>

#include "tracer/image.h"

namespace tracer {

class PreviewTiles;

/// Held by the caller of one render at a time, who may look from any thread.
class Preview {
 public:
  /// The image so far: the whole window, `side` (>= 1) pixels along its longer side where it has more, box-filtered;
  /// linear and premultiplied by `alpha`, which is 0 where nothing is known yet. Nothing while no render shows itself,
  /// and for moments in which it keeps its books: ask again soon. Takes some milliseconds, the more the larger the
  /// image: of each pixel here at most about 16 there are read. The render waits for none of it, but for the tile
  /// that is being read. Throws std::bad_alloc.
  std::optional<Image> look(std::uint32_t side);

 private:
  friend class PreviewTiles;
  std::mutex mutex_;  ///< held by whoever looks, and by the render when its tiles must not be read
  const PreviewTiles* tiles_ = nullptr;
};

}  // namespace tracer
