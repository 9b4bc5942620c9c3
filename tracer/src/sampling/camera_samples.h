#pragma once
/// Samples of pixels, as a batch holds them.

#include <span>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// One sample of the pixel (x, y) of the full image.
struct Sample {
  std::uint32_t x = 0, y = 0;
  Vec2 at;           ///< where in the pixel, in [0,1)^2
  Vec2 lens;         ///< in [0,1)^2; means nothing to a pinhole
  double share = 1;  ///< of the pixel's width that it covers: what textures are filtered by
  Batch::Sample choices;
};

inline void push(Batch& batch, const CompiledScene& scene, const Sample& sample) {
  batch.samples.push_back(sample.choices);
  batch.x.push_back(sample.x + sample.at.x);
  batch.y.push_back(sample.y + sample.at.y);
  if (scene.needs.lens) batch.lens.push_back(sample.lens);
  if (scene.needs.filtered_textures) batch.share.push_back(sample.share);
}

/// The place of pixel (x, y) in the order of the full image's pixels: what its random choices are derived from.
inline std::uint64_t pixel_index(const CompiledScene& scene, std::uint32_t x, std::uint32_t y) {
  return static_cast<std::uint64_t>(y) * scene.image.width + x;
}

/// What each of `count` samples of a pixel covers of its width.
inline double uniform_share(std::uint32_t count) { return 1 / std::sqrt(static_cast<double>(count)); }

/// Sample `index` of `count` that a pixel has of one sequence: the first few of them are stratified, whatever their
/// number. One alone sits in the centre.
inline Sample uniform_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                             std::uint32_t count) {
  const std::uint64_t key = pixel_key(pixel_index(scene, x, y), scene.accuracy.seed);
  return {x,
          y,
          pixel_sample(key, index, count),
          scene.needs.lens ? lens_sample(key, index, count) : Vec2{0.5, 0.5},
          uniform_share(count),
          {key, index}};
}

/// Whether anything is derived from a sample's choices beside where it sits and what of the lens it sees.
inline bool takes_chances(const CompiledScene& scene) {
  const bool branches = scene.needs.reflection || scene.needs.refraction;
  return scene.needs.soft_lights || (branches && scene.accuracy.cutoff_by_chance && scene.accuracy.cutoff > 0);
}

/// Of samples of pixels of one each that nothing is left to chance in: their keys stay as they are. Most of what a
/// simple image needs beside its rays would be to find them.
inline void fill_centered(Batch& batch, std::span<const Pixel> pixels) {
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    batch.x[i] = pixels[i].x + 0.5;
    batch.y[i] = pixels[i].y + 0.5;
  }
}

/// Some of the samples that each pixel has `of`: [first, last).
struct SomeSamples {
  std::uint32_t first, last, of;
};

/// Makes the batch these samples of these pixels, the first one of all pixels first: each as uniform_sample has it, but
/// for keys that nothing asks for.
inline void fill(Batch& batch, const CompiledScene& scene, std::span<const Pixel> pixels, const SomeSamples& some) {
  const bool lens = scene.needs.lens;
  const std::size_t size = pixels.size() * (some.last - some.first);
  batch.samples.resize(size);
  batch.x.resize(size);
  batch.y.resize(size);
  if (lens) batch.lens.resize(size);
  if (scene.needs.filtered_textures) batch.share.assign(size, uniform_share(some.of));
  if (some.of == 1 && !lens && !takes_chances(scene)) {
    fill_centered(batch, pixels);
    return;
  }
  const std::uint64_t seed = scene.accuracy.seed;
  std::size_t at = 0;
  for (std::uint32_t index = some.first; index < some.last; ++index) {
    for (const Pixel& pixel : pixels) {
      const std::uint64_t key = pixel_key(pixel_index(scene, pixel.x, pixel.y), seed);
      const Vec2 place = pixel_sample(key, index, some.of);
      batch.samples[at] = {key, index};
      batch.x[at] = pixel.x + place.x;
      batch.y[at] = pixel.y + place.y;
      if (lens) batch.lens[at] = lens_sample(key, index, some.of);
      ++at;
    }
  }
}

/// Sample `index` of the stream `stream` of a pixel, independent of all other streams and of uniform_sample. The first
/// few of them are stratified, whatever their number.
inline Sample fresh_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                           std::uint64_t stream) {
  const std::uint64_t key = mix(pixel_key(pixel_index(scene, x, y), scene.accuracy.seed) ^ mix(~stream));
  constexpr std::uint32_t many = std::numeric_limits<std::uint32_t>::max();
  return {x, y,           sequence_point(index, key), scene.needs.lens ? lens_sample(key, index, many) : Vec2{0.5, 0.5},
          1, {key, index}};
}

/// The same for pairs of samples, each pair mirrored in the pixel's centre: its mean has nothing of the image's
/// slope.
inline Sample mirrored_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                              std::uint64_t stream) {
  Sample sample = fresh_sample(scene, x, y, index, stream);
  if (index % 2 == 1) {
    const Vec2 first = fresh_sample(scene, x, y, index - 1, stream).at;
    sample.at = {1 - first.x, 1 - first.y};
  }
  return sample;
}

}  // namespace tracer
