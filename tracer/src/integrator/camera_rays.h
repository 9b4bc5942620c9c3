#pragma once
/// Samples of pixels as the camera rays of a batch.

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
  const double x = sample.x + sample.at.x, y = sample.y + sample.at.y;
  const TraceCamera::Aim aim = scene.needs.lens ? scene.camera.aim(x, y, sample.lens) : scene.camera.aim(x, y);
  batch.camera.push(aim.origin, aim.direction, {1, 1, 1}, static_cast<std::uint32_t>(batch.samples.size()), {}, 0,
                    Media::camera(scene));
  if (scene.needs.filtered_textures) batch.camera.widen(camera_cone(scene, aim.direction, sample.share));
  batch.samples.push_back(sample.choices);
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

/// Sample `index` of `count` of the stream `stream`, independent of all other streams and of uniform_sample. Two alone
/// are mirrored in the pixel's centre: their mean has nothing of the picture's slope.
inline Sample fresh_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                           std::uint32_t count, std::uint64_t stream) {
  const std::uint64_t key = mix(pixel_key(pixel_index(scene, x, y), scene.accuracy.seed) ^ mix(~stream));
  Vec2 at = sequence_point(count == 2 ? 0 : index, key);
  if (count == 2 && index == 1) at = {1 - at.x, 1 - at.y};
  constexpr std::uint32_t many = std::numeric_limits<std::uint32_t>::max();
  return {x, y, at, scene.needs.lens ? lens_sample(key, index, many) : Vec2{0.5, 0.5}, 1, {key, index}};
}

}  // namespace tracer
