#pragma once
/// The first sample of every pixel, or of as many as there is time for.

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/preview_tiles.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// The pilot's passes: every so many pixels in each direction, from one in a tile on. Against a deadline from coarse to
/// fine, so that whenever it comes there is an image; else all at once.
inline std::span<const std::uint32_t> pilot_strides(bool deadline) {
  static constexpr std::uint32_t strides[] = {32, 16, 8, 4, 2, 1};
  return deadline ? std::span(strides) : std::span(strides).last(1);
}

/// A place in an order of `count` things that has nothing to do with the usual one; each once.
inline std::uint64_t scattered(std::uint64_t index, std::uint64_t count) {
  // Steps of the golden ratio's size, made coprime to `count`, visit everything once.
  auto step = static_cast<std::uint64_t>(static_cast<double>(count) * 0.6180339887498949) | 1;
  const auto common = [](std::uint64_t a, std::uint64_t b) {
    while (b != 0) a = std::exchange(b, a % b);
    return a;
  };
  while (common(step, count) != 1) step += 2;
  return (index * step) % count;
}

/// Traces them, tile by tile, into a film's sketch.
template <class Model>
class Pilots {
 public:
  /// All must outlive it.
  Pilots(const CompiledScene& scene, Film& film, const Tiles& tiles, const Deadline& deadline, PreviewTiles& to_display)
      : scene_(scene),
        film_(film),
        tiles_(tiles),
        deadline_(deadline),
        shown_(to_display),
        finest_(tiles.count(), unsampled),
        cost_(tiles.count(), 1) {}

  /// The tile's pixels on a grid of that stride, or none of them where there is no time: a tile is of one fineness. The
  /// first tile's first are always traced: something to show. One thread at a time for each tile.
  void trace(std::uint64_t tile, std::uint32_t stride, Wavefront<Model>& wavefront) {
    const std::vector<Pixel> pixels = tiles_.pixels(tile);
    const bool must = tile == 0 && finest_[tile] == unsampled;
    if (!must && deadline_.over_before(static_cast<double>(pixels.size()) / (stride * stride))) return;
    Batch& batch = wavefront.batch();
    batch.clear();
    std::vector<std::size_t> places;
    batch.light_points = light_points;
    for (const Pixel& pixel : pixels) {
      const std::size_t place = tiles_.place(pixel);
      if (!on_grid(place, stride) || on_grid(place, finest_[tile])) continue;
      push(batch, scene_, sample(pixel));
      places.push_back(place);
    }
    const std::uint64_t before = wavefront.statistics().rays.total();
    if (!wavefront.trace()) return;
    PreviewTiles::Tile to_display(shown_, tile);
    const std::lock_guard lock(to_display);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Color& radiance = wavefront.radiance()[i];
      if (!finite(radiance)) continue;  // counted by the wavefront
      film_.sketch(places[i], stride, radiance, wavefront.omitted(), wavefront.gbuffer(), i);
    }
    const std::uint64_t rays = wavefront.statistics().rays.total() - before;
    if (!places.empty()) cost_[tile] = static_cast<float>(rays) / static_cast<float>(places.size());
    finest_[tile] = static_cast<std::uint8_t>(stride);
  }

  /// Gives tiles that there was no time for what the one before them has.
  void fill_tiles() {
    for (std::uint64_t tile = 1; tile < tiles_.count(); ++tile)
      if (finest_[tile] == unsampled)
        film_.fill_block(tiles_.first_place(tile), Tiles::side, tiles_.first_place(tile - 1));
  }

  /// Whether every pixel has a sample of its own.
  [[nodiscard]] bool whole() const {
    return std::all_of(finest_.begin(), finest_.end(), [](std::uint8_t stride) { return stride == 1; });
  }
  /// Rays of a sample in the tile, as its last pilots had.
  [[nodiscard]] float cost(std::uint64_t tile) const { return cost_[tile]; }

 private:
  static constexpr std::uint8_t unsampled = 255;
  static constexpr std::uint64_t stream = std::uint64_t{1} << 32;  ///< beyond those of all rounds
  /// By which camera rays know a soft light: one sample a pixel is to see where penumbrae are.
  static constexpr std::uint32_t light_points = 4;

  /// On a lens or a light there is no middle to prefer.
  Sample sample(const Pixel& pixel) const {
    if (scene_.needs.lens) return fresh_sample(scene_, pixel.x, pixel.y, 0, stream);
    return uniform_sample(scene_, pixel.x, pixel.y, 0, 1);
  }

  bool on_grid(std::size_t place, std::uint32_t stride) const {
    return stride != unsampled && (place % film_.width()) % stride == 0 && (place / film_.width()) % stride == 0;
  }

  const CompiledScene& scene_;
  Film& film_;
  const Tiles& tiles_;
  const Deadline& deadline_;
  PreviewTiles& shown_;
  std::vector<std::uint8_t> finest_;  ///< stride of each tile's pilots
  std::vector<float> cost_;           ///< of each tile
};

}  // namespace tracer
