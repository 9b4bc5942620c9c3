#pragma once
/// Samples of pixels, as a batch holds them.

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/math/sampling.h"

namespace tracer {

/// One sample of the pixel (x, y) of the full picture.
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

/// The place of pixel (x, y) in the order of the full picture's pixels: what its random choices are derived from.
inline std::uint64_t pixel_index(const CompiledScene& scene, std::uint32_t x, std::uint32_t y) {
  return static_cast<std::uint64_t>(y) * scene.image.width + x;
}

/// Sample `index` of `count` that a pixel has of one sequence: the first few of them are stratified, whatever their
/// number. One alone sits in the centre.
inline Sample uniform_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                             std::uint32_t count) {
  const std::uint64_t pixel = pixel_index(scene, x, y), seed = scene.accuracy.seed;
  const std::uint64_t key = pixel_key(pixel, seed);
  return {x,
          y,
          pixel_sample(pixel, index, count, seed),
          scene.needs.lens ? lens_sample(key, index, count) : Vec2{0.5, 0.5},
          1 / std::sqrt(static_cast<double>(count)),
          {key, index}};
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

/// The same for pairs of samples, each pair mirrored in the pixel's centre: its mean has nothing of the picture's
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
