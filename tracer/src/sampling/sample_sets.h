#pragma once
/// Sets of samples of pixels: the work of adaptive sampling. A set is stratified over its pixel and independent of all
/// other sets.

#include <cmath>
#include <span>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/pixel_sums.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Samples of one pixel.
struct SampleSets {
  enum class Kind : std::uint8_t {
    joint,     ///< one set
    measured,  ///< two sets of half the samples: their difference shows the error
    look       ///< two sets, for a pixel that keeps its pilot: they show the pilot's error, and are not in the image
  };
  std::uint32_t place = 0;  ///< index of the pixel in the window, row by row
  Kind kind = Kind::joint;
  std::uint32_t samples = 0;  ///< in all sets; even
  std::uint32_t round = 0;    ///< number of the pixel's earlier sets
};

/// Sums over the finite samples of a pixel's sets.
struct SetSums {
  std::array<Color, 2> mean{};           ///< mean of each set; joint samples are the first
  std::array<std::uint32_t, 2> count{};  ///< finite samples in each set
  LayerAccumulator layers{};             ///< empty unless the scene has layers
};

/// Appends `count` samples of a pixel, one in each of as many cells of equal area: rows of cells, each row as high as
/// it has cells.
inline void push_strata(Batch& batch, const CompiledScene& scene, const Pixel& pixel, std::uint64_t key,
                        std::uint32_t count) {
  const auto rows = static_cast<std::uint32_t>(std::lround(std::sqrt(count)));
  std::uint32_t index = 0;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint32_t end = (row + 1) * count / rows, cells = end - index;
    const double top = static_cast<double>(index) / count, height = static_cast<double>(cells) / count;
    for (std::uint32_t cell = 0; index < end; ++cell, ++index) {
      const std::uint64_t random = mix(key + index * 0x9e3779b97f4a7c15u);
      const double across = static_cast<double>(random >> 32) * 0x1p-32,
                   along = static_cast<double>(random & 0xffffffffu) * 0x1p-32;
      push(batch, scene,
           {pixel.x,
            pixel.y,
            {(cell + across) / cells, top + along * height},
            scene.needs.lens ? lens_sample(key, index, std::numeric_limits<std::uint32_t>::max()) : Vec2{0.5, 0.5},
            0,  // point samples: the effect of filtering textures over the pixel is an error that they measure
            {key, index}});
    }
  }
}

inline void push_sets(Batch& batch, const CompiledScene& scene, const Pixel& pixel, const SampleSets& sets) {
  const std::uint64_t of_pixel = pixel_key(pixel_index(scene, pixel.x, pixel.y), scene.accuracy.seed);
  const std::uint64_t key = mix(of_pixel ^ mix(~std::uint64_t{sets.round}));
  if (sets.kind == SampleSets::Kind::joint) {
    push_strata(batch, scene, pixel, key, sets.samples);
  } else {
    push_strata(batch, scene, pixel, mix(key + 1), sets.samples / 2);
    push_strata(batch, scene, pixel, mix(key + 2), sets.samples / 2);
  }
}

/// `first`: of the samples of the sets in the batch.
inline SetSums sums_of(const CompiledScene& scene, const Tracer& tracer, const SampleSets& sets, std::size_t first) {
  SetSums sums;
  const std::size_t split = sets.kind == SampleSets::Kind::joint ? sets.samples : sets.samples / 2;
  for (std::size_t i = 0; i < sets.samples; ++i) {
    const Color& radiance = tracer.radiance()[first + i];
    if (!finite(radiance)) continue;  // counted by the tracer
    sums.mean[i < split ? 0 : 1] += radiance;
    ++sums.count[i < split ? 0 : 1];
    if (scene.needs.layers) sums.layers.add(tracer.gbuffer(), first + i);
  }
  for (std::size_t set = 0; set < 2; ++set)
    if (sums.count[set] > 0) sums.mean[set] = sums.mean[set] * (1.0 / sums.count[set]);
  return sums;
}

/// Traces sets of samples, in batches. `use(index, sums)` is called for each, in order.
/// Returns false if cancelled, or when `stop(samples)` is true before a batch.
template <class Stop, class Use>
bool trace_sets(const CompiledScene& scene, const Tiles& tiles, std::span<const SampleSets> sets, Tracer& tracer,
                const Stop& stop, const Use& use) {
  constexpr std::size_t batch_samples = 2048;
  Batch& batch = tracer.batch();
  std::size_t done = 0;
  while (done < sets.size()) {
    batch.clear();
    std::size_t end = done;
    for (; end < sets.size() && batch.samples.size() < batch_samples; ++end)
      push_sets(batch, scene, tiles.pixel(sets[end].place), sets[end]);
    if (stop(batch.samples.size()) || !tracer.trace()) return false;
    for (std::size_t first = 0; done < end; first += sets[done++].samples)
      use(done, sums_of(scene, tracer, sets[done], first));
  }
  return true;
}

}  // namespace tracer
