#pragma once
/// Pilot samples: the first sample of every pixel, or of as many pixels as the deadline allows.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Strides of the passes: with a deadline from coarse (one pixel in a tile) to fine, so that there is an image at any
/// time; else one pass.
inline std::span<const std::uint32_t> pilot_strides(bool deadline) {
  static constexpr std::uint32_t strides[] = {32, 16, 8, 4, 2, 1};
  return deadline ? std::span(strides) : std::span(strides).last(1);
}

/// Traces the pilots tile by tile and stores them in the film as preview blocks.
class Pilots {
 public:
  /// The arguments must outlive it.
  Pilots(const CompiledScene& scene, Film& film, const Tiles& tiles, const Deadline& deadline, PreviewTiles& preview)
      : scene_(scene),
        film_(film),
        tiles_(tiles),
        deadline_(deadline),
        preview_(preview),
        stride_(tiles.count(), unsampled) {}

  /// Traces the tile's pixels on a grid of that stride, or none if there is no time. The first pass of the first tile
  /// is always traced, so that the image is never empty. One thread at a time for each tile.
  void trace(std::uint64_t tile, std::uint32_t stride, Tracer& tracer) {
    std::vector<Pixel> pixels = tiles_.pixels(tile);
    const std::uint8_t before = stride_[tile];
    const bool must = tile == 0 && before == unsampled;
    if (!must && deadline_.over_before(static_cast<double>(pixels.size()) / (stride * stride))) return;
    if (stride > 1 || before != unsampled)
      std::erase_if(pixels, [&](const Pixel& pixel) {
        const std::size_t place = tiles_.place(pixel);
        return !on_grid(place, stride) || on_grid(place, before);
      });
    Batch& batch = tracer.batch();
    batch.clear();
    batch.light_points = light_points;
    batch.sign = true;
    // At the center of the pixel; with a lens at a random position, since no point of the lens is preferred.
    if (!scene_.needs.lens) fill(batch, scene_, pixels, {0, 1, 1});
    for (std::size_t i = 0; scene_.needs.lens && i < pixels.size(); ++i)
      push(batch, scene_, fresh_sample(scene_, pixels[i].x, pixels[i].y, 0, stream));
    if (!tracer.trace()) return;
    PreviewTiles::Tile preview(preview_, tile);
    const std::lock_guard lock(preview);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Color& radiance = tracer.radiance()[i];
      if (!finite(radiance)) continue;  // counted by the tracer
      const std::size_t place = tiles_.place(pixels[i]);
      film_.add_pilot_sums(place, tracer.omitted(), tracer.gbuffer(), i);
      film_.set_pilot(place, stride, radiance, tracer.signatures()[i]);
    }
    stride_[tile] = static_cast<std::uint8_t>(stride);
  }

  /// Fills tiles without samples from the tile before them.
  void fill_tiles() {
    for (std::uint64_t tile = 1; tile < tiles_.count(); ++tile)
      if (stride_[tile] == unsampled)
        film_.fill_block(tiles_.first_place(tile), Tiles::side, tiles_.first_place(tile - 1));
  }

  /// True if every pixel has a sample of its own.
  [[nodiscard]] bool complete() const {
    return std::all_of(stride_.begin(), stride_.end(), [](std::uint8_t stride) { return stride == 1; });
  }
  /// The pilots of the tile are in the film.
  void set_traced(std::uint64_t tile) { stride_[tile] = 1; }

 private:
  static constexpr std::uint8_t unsampled = 255;
  static constexpr std::uint64_t stream = std::uint64_t{1} << 32;  ///< beyond the streams of all rounds
  /// Several points per area light, so that one sample per pixel finds penumbrae.
  static constexpr std::uint32_t light_points = 4;

  bool on_grid(std::size_t place, std::uint32_t stride) const {
    return stride != unsampled && (place % film_.width()) % stride == 0 && (place / film_.width()) % stride == 0;
  }

  const CompiledScene& scene_;
  Film& film_;
  const Tiles& tiles_;
  const Deadline& deadline_;
  PreviewTiles& preview_;
  std::vector<std::uint8_t> stride_;  ///< finest stride so far, by tile
};

}  // namespace tracer
